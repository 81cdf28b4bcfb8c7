#include "sim/mjpeg_writer.h"

#include <fmt/format.h>

#include <array>
#include <cstring>
#include <utility>

#include "base/check.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/error.h>
}

namespace trammel::sim {
namespace {

tl::unexpected<Error> AvFail(const std::filesystem::path& path, const char* what, int code) {
  std::array<char, AV_ERROR_MAX_STRING_SIZE> text{};
  av_strerror(code, text.data(), text.size());
  return Fail(fmt::format("{}: cannot {}: {}; is the disk full or the folder read-only?",
                          path.string(), what, text.data()));
}

}  // namespace

struct MjpegWriter::State {
  std::filesystem::path path;
  AVFormatContext* format = nullptr;
  AVPacket* packet = nullptr;
  int frames_per_s = 0;
  std::int64_t frames = 0;

  State() = default;
  State(const State&) = delete;
  State& operator=(const State&) = delete;
  ~State() {
    av_packet_free(&packet);
    if (format != nullptr) {
      avio_closep(&format->pb);
      avformat_free_context(format);
    }
  }
};

MjpegWriter::MjpegWriter(std::unique_ptr<State> state) : state_(std::move(state)) {}
MjpegWriter::MjpegWriter(MjpegWriter&&) noexcept = default;
MjpegWriter& MjpegWriter::operator=(MjpegWriter&&) noexcept = default;
MjpegWriter::~MjpegWriter() = default;

Result<MjpegWriter> MjpegWriter::Create(const std::filesystem::path& path, int width, int height,
                                        int frames_per_s) {
  TRAMMEL_CHECK(width > 0 && height > 0 && frames_per_s > 0, "{} x {} px at {} frames/s", width,
                height, frames_per_s);
  if (std::filesystem::exists(path)) {
    return Fail(fmt::format("{} exists already; choose another name or remove it", path.string()));
  }
  auto state = std::make_unique<State>();
  state->path = path;
  state->frames_per_s = frames_per_s;
  int code = avformat_alloc_output_context2(&state->format, nullptr, "avi", nullptr);
  if (code < 0) return AvFail(path, "prepare an AVI file", code);
  // Without this the file would carry the library's version and differ from machine to machine.
  state->format->flags |= AVFMT_FLAG_BITEXACT;
  AVStream* stream = avformat_new_stream(state->format, nullptr);
  state->packet = av_packet_alloc();
  if (stream == nullptr || state->packet == nullptr) {
    return AvFail(path, "prepare an AVI file", AVERROR(ENOMEM));
  }
  stream->codecpar->codec_type = AVMEDIA_TYPE_VIDEO;
  stream->codecpar->codec_id = AV_CODEC_ID_MJPEG;
  stream->codecpar->codec_tag = MKTAG('M', 'J', 'P', 'G');
  stream->codecpar->width = width;
  stream->codecpar->height = height;
  stream->time_base = {1, frames_per_s};
  stream->avg_frame_rate = {frames_per_s, 1};
  code = avio_open(&state->format->pb, path.c_str(), AVIO_FLAG_WRITE);
  if (code < 0) return AvFail(path, "create the video", code);
  code = avformat_write_header(state->format, nullptr);
  if (code < 0) return AvFail(path, "write the video's header", code);
  return MjpegWriter(std::move(state));
}

Result<void> MjpegWriter::Add(std::span<const std::uint8_t> jpeg) {
  TRAMMEL_CHECK(state_ != nullptr, "the video was finished before a frame of {} bytes",
                jpeg.size());
  AVPacket* packet = state_->packet;
  int code = av_new_packet(packet, static_cast<int>(jpeg.size()));
  if (code < 0) return AvFail(state_->path, "hold a frame", code);
  std::memcpy(packet->data, jpeg.data(), jpeg.size());
  AVStream* stream = state_->format->streams[0];
  packet->stream_index = 0;
  packet->pts = packet->dts =
      av_rescale_q(state_->frames++, {1, state_->frames_per_s}, stream->time_base);
  packet->duration = av_rescale_q(1, {1, state_->frames_per_s}, stream->time_base);
  packet->flags |= AV_PKT_FLAG_KEY;
  code = av_write_frame(state_->format, packet);
  av_packet_unref(packet);
  if (code < 0) return AvFail(state_->path, "write a frame", code);
  return {};
}

Result<void> MjpegWriter::Finish() {
  TRAMMEL_CHECK(state_ != nullptr, "the video is finished twice");
  const std::unique_ptr<State> state = std::move(state_);
  int code = av_write_trailer(state->format);
  if (code < 0) return AvFail(state->path, "write the video's index", code);
  code = avio_closep(&state->format->pb);
  if (code < 0) return AvFail(state->path, "close the video", code);
  return {};
}

}  // namespace trammel::sim
