// Frames per second of a camera's way to the disk, on 1280x720 MJPEG.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "machine/net/multipart.h"
#include "machine/video/video_writer.h"
#include "support/laser_world.h"
#include "support/scripted_http.h"
#include "support/test_pictures.h"
#include "vision/frame_change.h"

namespace trammel {
namespace {

Frame Picture() {
  Random random(1);
  test::LaserWorld world;
  world.width = 1280;
  world.height = 720;
  world.plate_column_px = 872;
  world.bead_row_px = 371;
  return test::DrawLaserFrame(world, 0.11, random);
}

const std::string& Jpeg() {
  static const std::string jpeg = test::JpegOf(Picture(), 90);
  return jpeg;
}

void SetFrames(benchmark::State& state) {
  state.counters["frames_per_s"] =
      benchmark::Counter(static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
  state.counters["frame_bytes"] = static_cast<double>(Jpeg().size());
}

machine::CapturedFrame Captured() {
  machine::CapturedFrame frame;
  frame.image.assign(Jpeg().begin(), Jpeg().end());
  frame.width_px = 1280;
  frame.height_px = 720;
  return frame;
}

/// The parser alone, in reads of 64 KiB.
void Parse(benchmark::State& state) {
  const std::string part = test::MjpegPart(Jpeg());
  const std::span bytes(reinterpret_cast<const std::uint8_t*>(part.data()), part.size());
  machine::MultipartReader reader("frame", {});
  for (auto _ : state) {
    constexpr std::size_t kRead = 64 * 1024;
    for (std::size_t at = 0; at < bytes.size(); at += kRead) {
      reader.Feed(bytes.subspan(at, std::min(kRead, bytes.size() - at)), 0);
      auto taken = reader.Take();
      benchmark::DoNotOptimize(taken);
    }
  }
  SetFrames(state);
}

/// From a socket on loopback to a checked frame.
void Receive(benchmark::State& state) {
  const std::string part = test::MjpegPart(Jpeg());
  const test::ScriptedHttp server([&](const std::string&, test::HttpPeer& peer) {
    peer.Send(test::MjpegHead());
    while (peer.Send(part)) {
    }
  });
  auto camera = machine::OpenCamera(server.Url("/"));
  for (auto _ : state) {
    auto frame = (*camera)->Next(10, {});
    benchmark::DoNotOptimize(frame);
  }
  camera->reset();
  SetFrames(state);
}

void Write(benchmark::State& state) {
  const test::TemporaryFolder folder;
  const machine::CapturedFrame frame = Captured();
  auto writer = machine::VideoWriter::Create(folder.path() / "0.avi");
  int files = 0;
  for (auto _ : state) {
    if (writer->frames() == 300) {  // a sweep of ten seconds
      std::filesystem::remove(folder.path() / (std::to_string(files) + ".avi"));
      writer = machine::VideoWriter::Create(folder.path() / (std::to_string(++files) + ".avi"));
    }
    auto added = writer->Add(frame);
    benchmark::DoNotOptimize(added);
  }
  SetFrames(state);
}

void Decode(benchmark::State& state) {
  const machine::CapturedFrame frame = Captured();
  for (auto _ : state) {
    auto decoded = machine::DecodeFrame(frame);
    benchmark::DoNotOptimize(decoded);
  }
  SetFrames(state);
}

void Change(benchmark::State& state) {
  const Frame frame = Picture();
  const vision::FrameChangeOptions options;
  vision::FrameSketch before;
  vision::FrameSketch after;
  std::vector<float> scratch;
  vision::SketchFrame(frame.view(), options, before);
  for (auto _ : state) {
    vision::SketchFrame(frame.view(), options, after);
    benchmark::DoNotOptimize(vision::FrameChange(before, after, options, scratch));
  }
  SetFrames(state);
}

BENCHMARK(Parse)->Name("parse_multipart_1280x720")->Unit(benchmark::kMicrosecond);
BENCHMARK(Receive)->Name("receive_http_1280x720")->Unit(benchmark::kMicrosecond)->UseRealTime();
BENCHMARK(Write)->Name("write_video_1280x720")->Unit(benchmark::kMicrosecond);
BENCHMARK(Decode)->Name("decode_jpeg_1280x720")->Unit(benchmark::kMicrosecond);
BENCHMARK(Change)->Name("frame_change_1280x720")->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace trammel
