// Photos and frames read and written, beside OpenCV's codecs with the same pixels.
#include <benchmark/benchmark.h>

#include <cstdint>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>
#include <vector>

#include "base/frame.h"
#include "image/jpeg_cutter.h"
#include "image/jpeg_reader.h"
#include "machine/camera/image_file.h"
#include "machine/camera/raw_picture.h"

namespace trammel {
namespace {

using Bytes = std::vector<std::uint8_t>;

// Texture of all sizes with a camera's noise.
cv::Mat Scene(int width, int height) {
  cv::RNG random(1);
  cv::Mat scene(height, width, CV_8UC3, cv::Scalar(90, 110, 120));
  for (int size = 4; size < height; size *= 3) {
    cv::Mat coarse(height / size + 1, width / size + 1, CV_8UC3);
    random.fill(coarse, cv::RNG::UNIFORM, 0, 256);
    cv::Mat fine;
    cv::resize(coarse, fine, scene.size(), 0, 0, cv::INTER_CUBIC);
    cv::addWeighted(scene, 0.7, fine, 0.3, 0, scene);
  }
  cv::Mat noise(height, width, CV_8UC3);
  random.fill(noise, cv::RNG::NORMAL, 4, 2);
  return scene + noise;
}

Bytes Encoded(const benchmark::State& state, const char* extension) {
  const cv::Mat scene = Scene(static_cast<int>(state.range(0)), static_cast<int>(state.range(1)));
  Bytes bytes;
  cv::imencode(extension, scene, bytes);
  return bytes;
}

void SetPixels(benchmark::State& state) {
  state.counters["megapixels/s"] = benchmark::Counter(
      1e-6 * static_cast<double>(state.range(0) * state.range(1) * state.iterations()),
      benchmark::Counter::kIsRate);
}

void Read(benchmark::State& state, const char* extension) {
  const Bytes bytes = Encoded(state, extension);
  for (auto _ : state) {
    auto frame = machine::DecodeImage(bytes);
    benchmark::DoNotOptimize(frame);
  }
  SetPixels(state);
}

void ReadByOpenCv(benchmark::State& state, const char* extension) {
  const Bytes bytes = Encoded(state, extension);
  for (auto _ : state) {
    cv::Mat image = cv::imdecode(bytes, cv::IMREAD_COLOR);
    benchmark::DoNotOptimize(image.data);
  }
  SetPixels(state);
}

void Write(benchmark::State& state, int jpeg_quality) {
  constexpr std::uint32_t kBgr8 = 0x02180015;
  const cv::Mat scene = Scene(static_cast<int>(state.range(0)), static_cast<int>(state.range(1)));
  const machine::RawPicture raw{
      kBgr8, scene.cols, scene.rows, 0, {scene.data, scene.total() * scene.elemSize()}};
  std::size_t size = 0;
  for (auto _ : state) {
    auto picture = machine::ToPicture(raw, jpeg_quality);
    size = picture ? picture->size() : 0;
  }
  SetPixels(state);
  state.counters["bytes"] = static_cast<double>(size);
}

void WriteByOpenCv(benchmark::State& state, int jpeg_quality) {
  const cv::Mat scene = Scene(static_cast<int>(state.range(0)), static_cast<int>(state.range(1)));
  Bytes bytes;
  for (auto _ : state) {
    if (jpeg_quality > 0) {
      cv::imencode(".jpg", scene, bytes, {cv::IMWRITE_JPEG_QUALITY, jpeg_quality});
    } else {
      cv::imencode(".png", scene, bytes);
    }
  }
  SetPixels(state);
  state.counters["bytes"] = static_cast<double>(bytes.size());
}

// The paper's crop, at the same place of every size.
PixelRect CropOf(const benchmark::State& state) {
  return {static_cast<int>(state.range(0) * 837 / 1280),
          static_cast<int>(state.range(1) * 341 / 720), 45, 60};
}

void SetFrames(benchmark::State& state) {
  state.counters["frames/s"] =
      benchmark::Counter(static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
}

void CutJpeg(benchmark::State& state) {
  const Bytes bytes = Encoded(state, ".jpg");
  Bytes cut;
  for (auto _ : state) {
    auto done = image::CutJpeg(bytes, CropOf(state), cut);
    if (!done) state.SkipWithError(done.error().message.c_str());
  }
  SetFrames(state);
  state.counters["bytes"] = static_cast<double>(bytes.size());
  state.counters["cut bytes"] = static_cast<double>(cut.size());
}

void ReadPart(benchmark::State& state, bool of_cut) {
  Bytes bytes = Encoded(state, ".jpg");
  PixelRect part = CropOf(state);
  if (of_cut) {
    Bytes cut;
    if (auto done = image::CutJpeg(bytes, part, cut); !done) {
      return state.SkipWithError(done.error().message.c_str());
    }
    bytes = std::move(cut);
    const auto reader = image::JpegReader::Open(bytes, image::JpegDamage::kRefuse);
    part.x -= reader->header().place->x;
    part.y -= reader->header().place->y;
  }
  std::vector<std::uint8_t> row(static_cast<std::size_t>(3 * part.width));
  for (auto _ : state) {
    auto reader = image::JpegReader::Open(bytes, image::JpegDamage::kRefuse);
    auto read = reader->StartPart(image::JpegPixels::kBgr, part);
    for (int y = 0; read && y < part.height; ++y) read = reader->ReadRow(row.data());
    if (read) read = reader->ReadRest();
    if (!read) state.SkipWithError(read.error().message.c_str());
  }
  SetFrames(state);
}

void Sizes(benchmark::internal::Benchmark* bench) {
  bench->Args({1280, 720})->Args({4000, 3000})->Unit(benchmark::kMillisecond);
}

BENCHMARK_CAPTURE(Read, jpeg, ".jpg")->Apply(Sizes);
BENCHMARK_CAPTURE(ReadByOpenCv, jpeg, ".jpg")->Apply(Sizes);
BENCHMARK_CAPTURE(Read, png, ".png")->Apply(Sizes);
BENCHMARK_CAPTURE(ReadByOpenCv, png, ".png")->Apply(Sizes);
BENCHMARK_CAPTURE(ReadPart, of_the_whole, false)->Apply(Sizes);
BENCHMARK_CAPTURE(ReadPart, of_a_cut, true)->Apply(Sizes);
BENCHMARK(CutJpeg)->Apply(Sizes);
BENCHMARK_CAPTURE(Write, jpeg, 95)->Apply(Sizes);
BENCHMARK_CAPTURE(WriteByOpenCv, jpeg, 95)->Apply(Sizes);
BENCHMARK_CAPTURE(Write, png, 0)->Apply(Sizes);
BENCHMARK_CAPTURE(WriteByOpenCv, png, 0)->Apply(Sizes);

}  // namespace
}  // namespace trammel
