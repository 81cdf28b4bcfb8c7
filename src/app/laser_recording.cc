#include "app/laser_recording.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <span>
#include <system_error>
#include <utility>

#include "machine/video_file.h"
#include "pressure_advance/laser_crop.h"
#include "pressure_advance/laser_eye.h"
#include "store/recording.h"

namespace trammel::app {
namespace {

using pressure_advance::Scan;
using pressure_advance::ScanLine;

/// Cropped frames of one line may take this much memory.
constexpr std::size_t kMaxSweepBytes = std::size_t{1} << 30;

/// Size of the recording's frames, known from the first one on.
struct FrameSize {
  int width = 0;
  int height = 0;
  std::string video;  ///< that set it
};

Result<void> CheckCrop(const PixelRect& crop, const machine::VideoFile& frame) {
  if (crop.x + crop.width > frame.width_px() || crop.y + crop.height > frame.height_px()) {
    return Fail(
        fmt::format("crop_px is {}x{} at ({}, {}), but the frames have {}x{} px; it must "
                    "lie within the frame",
                    crop.width, crop.height, crop.x, crop.y, frame.width_px(), frame.height_px()));
  }
  return {};
}

Result<void> CheckSize(const ScanLine& line, const machine::VideoFile& frame, FrameSize& size) {
  if (size.video.empty()) {
    size = {frame.width_px(), frame.height_px(), line.video};
  }
  if (frame.width_px() != size.width || frame.height_px() != size.height) {
    return Fail(fmt::format("video '{}' has frames of {}x{} px, '{}' of {}x{}; record all lines "
                            "with one camera mode",
                            line.video, frame.width_px(), frame.height_px(), size.video, size.width,
                            size.height),
                ErrorKind::kMeasurement);
  }
  return {};
}

/// That a video has as many frames as scan.json says of it.
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

/// Whether a frame may be looked at.
bool IsPlaced(const ScanLine& line, std::size_t frame) {
  const auto& positions = line.frame_positions_mm;
  return positions.empty() || (frame < positions.size() && positions[frame].has_value());
}

/// The video of a line, which a link must not lead out of the recording.
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

/// All frames of one sweep, cropped and upright; those that must not be looked at are empty.
Result<std::vector<Frame>> ReadFrames(const std::filesystem::path& folder, const Scan& scan,
                                      const ScanLine& line, const PixelRect& crop,
                                      FrameSize& size) {
  const auto path = VideoOf(folder, line);
  if (!path) return tl::unexpected(path.error());
  auto video = machine::VideoFile::Open(*path);
  if (!video) {
    return tl::unexpected(video.error());
  }
  std::vector<Frame> frames;
  std::size_t bytes = 0;
  for (;;) {
    const auto more = video->Advance();
    if (!more) return tl::unexpected(more.error());
    if (!*more) break;
    frames.emplace_back();
    if (!IsPlaced(line, frames.size() - 1)) continue;  // keeps its number; nobody may look at it
    if (auto fits = CheckSize(line, *video, size); !fits) return tl::unexpected(fits.error());
    if (auto fits = CheckCrop(crop, *video); !fits) return tl::unexpected(fits.error());
    const auto cropped = video->Decode(crop);
    if (!cropped) return tl::unexpected(cropped.error());
    pressure_advance::TurnUpright((*cropped)->view(), scan.height_direction, frames.back());
    bytes += frames.back().bgr.size();
    if (bytes > kMaxSweepBytes) {
      return Fail(
          fmt::format("video '{}': {} frames of {}x{} px are more than {} MB; make crop_px "
                      "smaller or record one sweep per file",
                      line.video, frames.size(), crop.width, crop.height, kMaxSweepBytes >> 20),
          ErrorKind::kMeasurement);
    }
  }
  if (auto fits = CheckCount(line, frames.size()); !fits) {
    return tl::unexpected(fits.error());
  }
  return frames;
}

/// Up to 16 whole frames (4 of large ones) spread evenly over the part of a sweep that may be
/// looked at, upright.
Result<std::vector<Frame>> SampleFrames(const std::filesystem::path& folder, const Scan& scan,
                                        const ScanLine& line) {
  constexpr std::size_t kMostFrames = 16;
  constexpr std::size_t kFewestFrames = 4;
  const auto path = VideoOf(folder, line);
  if (!path) return tl::unexpected(path.error());
  auto video = machine::VideoFile::Open(*path);
  if (!video) {
    return tl::unexpected(video.error());
  }
  std::vector<Frame> frames;
  std::size_t stride = 1;
  std::size_t placed = 0;
  for (std::size_t frame = 0;; ++frame) {
    const auto more = video->Advance();
    if (!more) return tl::unexpected(more.error());
    if (!*more) return frames;
    if (!IsPlaced(line, frame)) continue;
    const std::size_t i = placed++;
    if (i % stride != 0) continue;
    const PixelRect whole{0, 0, video->width_px(), video->height_px()};
    const auto pixels =
        static_cast<std::size_t>(whole.width) * static_cast<std::size_t>(whole.height);
    const bool large = 3 * pixels * kMostFrames > kMaxSweepBytes / 2;
    const std::size_t most = large ? kFewestFrames : kMostFrames;
    if (frames.size() >= most) {  // every second one makes room for the rest
      for (std::size_t k = 1; k < most / 2; ++k) {
        frames[k] = std::move(frames[2 * k]);
      }
      frames.resize(most / 2);
      stride *= 2;
      if (i % stride != 0) continue;
    }
    const auto decoded = video->Decode(whole);
    if (!decoded) return tl::unexpected(decoded.error());
    frames.emplace_back();
    pressure_advance::TurnUpright((*decoded)->view(), scan.height_direction, frames.back());
  }
}

/// Fills in scan.crop from the middle line, whose bead is likely the most even.
Result<void> LocateCrop(const std::filesystem::path& folder, Scan& scan,
                        vision::LaserLineWorkspace& workspace, std::vector<std::string>& notices) {
  const ScanLine& line = scan.lines[scan.lines.size() / 2];
  const std::string& video = line.video;
  const auto frames = SampleFrames(folder, scan, line);
  if (!frames) {
    return tl::unexpected(frames.error());
  }
  const auto found = FindCrop(*frames, scan.height_direction, workspace);
  if (!found.crop) {
    return Fail(
        fmt::format("crop_px is absent and could not be found in '{}': {}", video, found.fault),
        ErrorKind::kMeasurement);
  }
  scan.crop = found.crop;
  notices.push_back(fmt::format("crop_px was not given; found {}x{} px at ({}, {})",
                                scan.crop->width, scan.crop->height, scan.crop->x, scan.crop->y));
  return {};
}

/// One example frame on its way to heights, for the report.
pressure_advance::FrameSteps StepsOf(std::size_t line, const std::vector<Frame>& frames,
                                     const pressure_advance::SweepReading& reading,
                                     const pressure_advance::DeviationOptions& options) {
  pressure_advance::FrameSteps steps;
  steps.line = line;
  steps.frame = reading.frame[reading.example_column];
  steps.crop = frames[steps.frame];
  pressure_advance::DeviationFrame filtered;
  FilterFrame(steps.crop.view(), options, filtered);
  steps.masked = filtered.masked;
  steps.blurred = Frame(steps.crop.width, steps.crop.height);
  for (std::size_t i = 0; i < filtered.blurred.size(); ++i) {
    std::fill_n(steps.blurred.bgr.begin() + static_cast<std::ptrdiff_t>(3 * i), 3,
                filtered.blurred[i]);
  }
  for (const double centre : filtered.centre_px) {
    steps.paper_centre_px.push_back(centre == pressure_advance::kNoCentre ? steps.crop.width
                                                                          : centre);
  }
  steps.centre_px = reading.example.centre_px;
  steps.centre_sigma_px = reading.example.sigma_px;
  return steps;
}

// Frames without a position between others that have one: the head stood in those at either end.
std::size_t UnplacedWithin(const std::vector<std::optional<double>>& positions) {
  const auto placed = [](const std::optional<double>& position) { return position.has_value(); };
  const auto first = std::find_if(positions.begin(), positions.end(), placed);
  const auto last = std::find_if(positions.rbegin(), positions.rend(), placed).base();
  return first < last ? static_cast<std::size_t>(std::count(first, last, std::nullopt)) : 0;
}

void AddNotices(const ScanLine& line, const pressure_advance::SweepReading& reading,
                std::vector<std::string>& notices) {
  if (reading.still_frames > 0) {
    notices.push_back(fmt::format("'{}': {} frames left out, the laser stood still in them",
                                  line.video, reading.still_frames));
  }
  if (const std::size_t unplaced = UnplacedWithin(line.frame_positions_mm); unplaced > 0) {
    notices.push_back(
        fmt::format("'{}': {} frames of the sweep left out, the recording gives them no "
                    "position",
                    line.video, unplaced));
  }
  if (reading.off_line_frames > 0) {
    notices.push_back(fmt::format("'{}': {} frames left out, they lie past the ends of the line",
                                  line.video, reading.off_line_frames));
  }
  if (reading.cut_off_frames > 0) {
    notices.push_back(
        fmt::format("'{}': {} frames left out, the bead in them reaches out of crop_px; make it "
                    "larger, or leave it out",
                    line.video, reading.cut_off_frames));
  }
}

}  // namespace

Result<LaserMeasurement> MeasureRecording(const std::filesystem::path& folder,
                                          const pressure_advance::DeviationOptions& deviation) {
  if (auto valid = Validate(deviation); !valid) {
    return tl::unexpected(valid.error());
  }
  auto scan = store::ReadScan(folder);
  if (!scan) {
    return tl::unexpected(scan.error());
  }
  LaserMeasurement result;
  result.scan = std::move(*scan);
  FrameSize size;
  vision::LaserLineWorkspace workspace;
  if (!result.scan.crop) {
    if (auto located = LocateCrop(folder, result.scan, workspace, result.notices); !located) {
      return tl::unexpected(located.error());
    }
  }
  pressure_advance::DeviationFrame scratch;
  std::vector<double> pressure_advance_s;
  std::vector<std::optional<double>> scores;
  for (std::size_t i = 0; i < result.scan.lines.size(); ++i) {
    const ScanLine& line = result.scan.lines[i];
    auto frames = ReadFrames(folder, result.scan, line, *result.scan.crop, size);
    if (!frames) {
      return tl::unexpected(frames.error());
    }
    auto reading = ReadSweep(*frames, result.scan, line, {}, workspace);
    auto paper =
        DeviationHeights(*frames, reading.frame, result.scan.height_direction, deviation, scratch);
    paper.position_mm = reading.heights.position_mm;
    scores.push_back(DeviationScore(paper));
    pressure_advance_s.push_back(line.pressure_advance_s);
    if (!result.view.steps && reading.profile.unusable.empty()) {
      result.view.steps = StepsOf(i, *frames, reading, deviation);
    }
    AddNotices(line, reading, result.notices);
    result.profiles.push_back(std::move(reading.profile));
    result.view.heights.push_back(std::move(reading.heights));
    result.view.paper_heights.push_back(std::move(paper));
  }
  result.deviation = pressure_advance::ScoreByDeviation(pressure_advance_s, scores);
  return result;
}

}  // namespace trammel::app
