#include "sim/camera/mjpeg_writer.h"

#include <fmt/format.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <utility>
#include <vector>

#include "base/check.h"
#include "image/avi_form.h"

namespace trammel::sim {

struct MjpegWriter::State {
  std::filesystem::path path;
  std::ofstream file;
  std::size_t bytes = 0;
  std::vector<image::AviEntry> index;

  void Put(std::span<const std::uint8_t> data) {
    file.write(reinterpret_cast<const char*>(data.data()),
               static_cast<std::streamsize>(data.size()));
    bytes += data.size();
  }
  [[nodiscard]] tl::unexpected<Error> Broken(const char* what) const {
    return Fail(fmt::format("{}: cannot {}: {}; is the disk full or the folder read-only?",
                            path.string(), what, std::strerror(errno)));
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
  state->file.open(path, std::ios::binary);
  if (!state->file) return state->Broken("create the video");
  state->Put(image::AviHead({width, height, static_cast<double>(frames_per_s)}));
  if (!state->file) return state->Broken("write the video's header");
  return MjpegWriter(std::move(state));
}

Result<void> MjpegWriter::Add(std::span<const std::uint8_t> jpeg) {
  TRAMMEL_CHECK(state_ != nullptr, "the video was finished before a frame of {} bytes",
                jpeg.size());
  State& state = *state_;
  if (state.bytes + jpeg.size() > image::kMostAviBytes) {
    return Fail(fmt::format("{}: more than {} bytes after {} frames; choose shorter sweeps",
                            state.path.string(), image::kMostAviBytes, state.index.size()));
  }
  state.index.push_back({state.bytes, jpeg.size()});
  state.Put(image::AviFrameHead(jpeg.size()));
  state.Put(jpeg);
  constexpr std::uint8_t kPadding = 0;
  if (jpeg.size() % 2 == 1) state.Put({&kPadding, 1});
  if (!state.file) return state.Broken("write a frame");
  return {};
}

Result<void> MjpegWriter::Finish() {
  TRAMMEL_CHECK(state_ != nullptr, "the video is finished twice");
  const std::unique_ptr<State> state = std::move(state_);
  const std::size_t frames_end = state->bytes;
  state->Put(image::AviIndex(state->index));
  for (const image::AviPatch& patch :
       image::AviSizes(state->index.size(), frames_end, state->bytes)) {
    state->file.seekp(static_cast<std::streamoff>(patch.at));
    state->file.write(reinterpret_cast<const char*>(patch.bytes.data()), patch.bytes.size());
  }
  state->file.close();
  if (!state->file) return state->Broken("write the video's index");
  return {};
}

}  // namespace trammel::sim
