#include "pressure_advance/procedure/recorded_frames.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <optional>
#include <system_error>
#include <utility>

#include "base/check.h"
#include "base/frame.h"
#include "machine/video/video_cutter.h"
#include "machine/video/video_file.h"
#include "pressure_advance/files/recording.h"
#include "pressure_advance/laser/laser_reader.h"

namespace trammel::procedure {
namespace {

using pressure_advance::Scan;
using pressure_advance::ScanLine;

// Checks that a video has as many frames as scan.json states.
Result<void> CheckCount(const ScanLine& line, std::size_t frames) {
  const auto wrong = [&](const char* key, const char* what, std::size_t entries) {
    return Fail(fmt::format("video '{}' has {} frames, its {} {} {}; record the line again or "
                            "leave {} out",
                            line.video, frames, key, entries, what, key),
                ErrorKind::kMeasurement);
  };
  if (!line.frame_times_s.empty() && line.frame_times_s.size() != frames) {
    return wrong("frame_times_s", "times", line.frame_times_s.size());
  }
  if (!line.frame_positions_mm.empty() && line.frame_positions_mm.size() != frames) {
    return wrong("frame_positions_mm", "entries", line.frame_positions_mm.size());
  }
  return {};
}

// True if a frame may be used.
bool IsPlaced(const ScanLine& line, std::size_t frame) {
  const auto& positions = line.frame_positions_mm;
  return positions.empty() || (frame < positions.size() && positions[frame].has_value());
}

Result<void> CheckCrop(const PixelRect& crop, const machine::VideoFile& frame,
                       const std::string& video) {
  if (!Contains({0, 0, frame.width_px(), frame.height_px()}, crop)) {
    return Fail(
        fmt::format("crop_px is {}x{} at ({}, {}), but the frames have {}x{} px; it must "
                    "lie within the frame",
                    crop.width, crop.height, crop.x, crop.y, frame.width_px(), frame.height_px()));
  }
  const PixelRect held = frame.readable();
  if (Contains(held, crop)) return {};
  return Fail(fmt::format("crop_px is {}x{} at ({}, {}), but '{}' was cut: {}x{} px at ({}, {}) of "
                          "its frames can be read; scan again with --keep-full, or leave crop_px "
                          "as it was found",
                          crop.width, crop.height, crop.x, crop.y, video, held.width, held.height,
                          held.x, held.y),
              ErrorKind::kMeasurement);
}

Result<void> CheckSize(const ScanLine& line, const machine::VideoFile& frame,
                       const FrameSize& size) {
  if (frame.width_px() != size.width || frame.height_px() != size.height) {
    return Fail(fmt::format("video '{}' has frames of {}x{} px, '{}' of {}x{}; record all lines "
                            "with one camera mode",
                            line.video, frame.width_px(), frame.height_px(), size.video, size.width,
                            size.height),
                ErrorKind::kMeasurement);
  }
  return {};
}

/// Returns up to 16 whole frames (4 of large ones), upright and spread evenly over a sweep's usable
/// and uncut ones.
Result<std::vector<Frame>> SampleFrames(const std::filesystem::path& folder, const Scan& scan,
                                        const ScanLine& line) {
  constexpr std::size_t kMaxFrames = 16;
  constexpr std::size_t kFewestFrames = 4;
  const auto path = TRY(VideoOf(folder, line));
  auto video = machine::VideoFile::Open(path);
  if (!video) {
    return tl::unexpected(video.error());
  }
  std::vector<Frame> frames;
  std::size_t stride = 1;
  std::size_t placed = 0;
  for (std::size_t frame = 0;; ++frame) {
    const auto more = TRY(video->Advance());
    if (!more) return frames;
    if (!IsPlaced(line, frame)) continue;
    const PixelRect whole{0, 0, video->width_px(), video->height_px()};
    if (!Contains(video->readable(), whole)) continue;
    const std::size_t i = placed++;
    if (i % stride != 0) continue;
    const auto pixels =
        static_cast<std::size_t>(whole.width) * static_cast<std::size_t>(whole.height);
    const bool large = 3 * pixels * kMaxFrames > kMaxSweepBytes / 2;
    const std::size_t most = large ? kFewestFrames : kMaxFrames;
    if (frames.size() >= most) {  // every second one makes room for the rest
      for (std::size_t k = 1; k < most / 2; ++k) {
        frames[k] = std::move(frames[2 * k]);
      }
      frames.resize(most / 2);
      stride *= 2;
      if (i % stride != 0) continue;
    }
    const auto decoded = TRY(video->Decode(whole));
    frames.emplace_back();
    pressure_advance::TurnUpright(decoded->view(), scan.height_direction, frames.back());
  }
}

}  // namespace

Result<std::filesystem::path> VideoOf(const std::filesystem::path& folder, const ScanLine& line) {
  const std::filesystem::path path = folder / line.video;
  std::error_code missing;  // said by whoever opens it
  const auto real = std::filesystem::canonical(path, missing);
  if (missing) return path;
  const auto home = std::filesystem::canonical(folder, missing);
  if (std::mismatch(home.begin(), home.end(), real.begin(), real.end()).first != home.end()) {
    return Fail(fmt::format("video '{}': it is a link out of the recording's folder; copy the file",
                            path.string()),
                ErrorKind::kMeasurement);
  }
  return path;
}

Result<FrameSize> SizeOf(const std::filesystem::path& folder, const Scan& scan) {
  for (const ScanLine& line : scan.lines) {
    const auto path = TRY(VideoOf(folder, line));
    auto video = TRY(machine::VideoFile::Open(path));
    for (std::size_t frame = 0;; ++frame) {
      const auto more = TRY(video.Advance());
      if (!more) break;
      if (IsPlaced(line, frame)) return FrameSize{video.width_px(), video.height_px(), line.video};
    }
  }
  return FrameSize{};
}

Result<std::vector<Frame>> ReadFrames(const std::filesystem::path& path, const Scan& scan,
                                      const ScanLine& line, const FrameSize& size) {
  const PixelRect& crop = *scan.crop;
  auto video = machine::VideoFile::Open(path);
  if (!video) {
    return tl::unexpected(video.error());
  }
  std::vector<Frame> frames;
  std::size_t bytes = 0;
  for (;;) {
    const auto more = TRY(video->Advance());
    if (!more) break;
    frames.emplace_back();
    if (!IsPlaced(line, frames.size() - 1)) continue;  // keeps its number; nobody may look at it
    TRY(CheckSize(line, *video, size));
    TRY(CheckCrop(crop, *video, line.video));
    const auto cropped = TRY(video->Decode(crop));
    pressure_advance::TurnUpright(cropped->view(), scan.height_direction, frames.back());
    bytes += frames.back().bgr.size();
    if (bytes > kMaxSweepBytes) {
      return Fail(
          fmt::format("video '{}': {} frames of {}x{} px are more than {} MB; make crop_px "
                      "smaller or record one sweep per file",
                      line.video, frames.size(), crop.width, crop.height, kMaxSweepBytes >> 20),
          ErrorKind::kMeasurement);
    }
  }
  TRY(CheckCount(line, frames.size()));
  return frames;
}

Result<pressure_advance::FoundCrop> FindCropIn(const std::filesystem::path& folder,
                                               const Scan& scan, const ScanLine& line) {
  const auto frames = TRY(SampleFrames(folder, scan, line));
  if (frames.empty()) {
    return pressure_advance::FoundCrop{std::nullopt, "its frames were cut, and none is whole"};
  }
  vision::LaserLineWorkspace workspace;
  return pressure_advance::FindCrop(frames, scan.height_direction, workspace);
}

namespace {

constexpr double kWholeEvery_s = 6;

Result<void> CheckReadable(const std::vector<Frame>& frames, const Scan& scan,
                           const ScanLine& line) {
  vision::LaserLineWorkspace workspace;
  const auto reading = ReadSweep(frames, scan, line, {}, workspace);
  if (!reading.profile.unusable.empty()) {
    return Fail(reading.profile.unusable, ErrorKind::kMeasurement);
  }
  if (reading.cut_off_frames == 0) return {};
  return Fail(fmt::format("the bead reaches out of the crop in {} frames", reading.cut_off_frames),
              ErrorKind::kMeasurement);
}

bool SamePixels(const std::vector<Frame>& one, const std::vector<Frame>& other) {
  return std::equal(one.begin(), one.end(), other.begin(), other.end(),
                    [](const Frame& a, const Frame& b) { return a.bgr == b.bgr; });
}

// Cuts a video (machine/video/video_cutter.h) if each of its lines reads well within the crop and
// every frame's crop is bit-identical in the cut. A whole frame remains every 6 s.
// @param scan  with the crop and only the lines of this video
// Errors, after which the video is unchanged: a line cannot be read, or its bead reaches out of the
// crop; the video's, the disk's, kInterrupted.
Result<void> CutVideo(const std::filesystem::path& folder, const Scan& scan,
                      const std::stop_token& stop) {
  TRAMMEL_CHECK(scan.crop && !scan.lines.empty(), "a crop: {}, {} lines", scan.crop.has_value(),
                scan.lines.size());
  const ScanLine& line = scan.lines.front();
  const auto video = TRY(VideoOf(folder, line));
  const auto size = TRY(SizeOf(folder, scan));
  ScanLine all = line;  // frames that have no place now may get one from the lines to come
  all.frame_positions_mm.clear();
  const auto whole = TRY(ReadFrames(video, scan, all, size));
  for (const ScanLine& one : scan.lines) {
    TRY(CheckReadable(whole, scan, one));
  }
  const double whole_every = std::max(1.0, std::round(kWholeEvery_s * scan.frames_per_s));
  auto cut = TRY(machine::CutVideo::Write(
      video, {*scan.crop, static_cast<std::size_t>(whole_every), scan.frames_per_s}, stop));
  const auto again = TRY(ReadFrames(cut.path(), scan, all, size));
  if (!SamePixels(whole, again)) {
    return Fail("its cut does not read as the whole does", ErrorKind::kMeasurement);
  }
  return cut.TakePlace();
}

}  // namespace

std::vector<std::string> CutRecording(const std::filesystem::path& folder,
                                      const std::stop_token& stop) {
  auto scan = files::ReadScan(folder);
  if (!scan) return {scan.error().message};
  if (!scan->crop) scan->crop = scan->found_crop;
  if (!scan->crop) return {};
  std::map<std::string, Scan> videos;  // each with its own lines only
  Scan without_lines = *scan;
  without_lines.lines.clear();
  for (ScanLine& line : scan->lines) {
    videos.emplace(line.video, without_lines).first->second.lines.push_back(std::move(line));
  }
  std::vector<std::string> whole;
  for (const auto& [video, of_video] : videos) {
    if (stop.stop_requested()) break;
    if (const auto cut = CutVideo(folder, of_video, stop); !cut) {
      whole.push_back(fmt::format("{} keeps its whole frames: {}", video, cut.error().message));
    }
  }
  return whole;
}

}  // namespace trammel::procedure
