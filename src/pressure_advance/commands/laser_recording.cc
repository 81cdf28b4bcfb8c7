#include "pressure_advance/commands/laser_recording.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <optional>
#include <span>
#include <system_error>
#include <utility>

#include "base/parallel.h"
#include "machine/video/video_file.h"
#include "pressure_advance/files/recording.h"
#include "pressure_advance/laser/laser_crop.h"
#include "pressure_advance/laser/laser_eye.h"

namespace trammel::app {
namespace {

using pressure_advance::Scan;
using pressure_advance::ScanLine;

/// Cropped frames of one line may take this much memory.
constexpr std::size_t kMaxSweepBytes = std::size_t{1} << 30;

/// Size of the recording's frames.
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

/// The size of the first frame of all that may be looked at; 0 where there is none.
Result<FrameSize> SizeOf(const std::filesystem::path& folder, const Scan& scan) {
  for (const ScanLine& line : scan.lines) {
    const auto path = VideoOf(folder, line);
    if (!path) return tl::unexpected(path.error());
    auto video = machine::VideoFile::Open(*path);
    if (!video) return tl::unexpected(video.error());
    for (std::size_t frame = 0;; ++frame) {
      const auto more = video->Advance();
      if (!more) return tl::unexpected(more.error());
      if (!*more) break;
      if (IsPlaced(line, frame))
        return FrameSize{video->width_px(), video->height_px(), line.video};
    }
  }
  return FrameSize{};
}

/// All frames of one sweep, cropped and upright; those that must not be looked at are empty.
Result<std::vector<Frame>> ReadFrames(const std::filesystem::path& folder, const Scan& scan,
                                      const ScanLine& line, const FrameSize& size) {
  const PixelRect& crop = *scan.crop;
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
                        std::vector<std::string>& notices) {
  const ScanLine& line = scan.lines[scan.lines.size() / 2];
  const std::string& video = line.video;
  const auto frames = SampleFrames(folder, scan, line);
  if (!frames) {
    return tl::unexpected(frames.error());
  }
  vision::LaserLineWorkspace workspace;
  const auto found = pressure_advance::FindCrop(*frames, scan.height_direction, workspace);
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

/// What one sweep gives.
struct MeasuredLine {
  pressure_advance::SweepReading reading;
  pressure_advance::HeightMap paper;
  std::optional<pressure_advance::FrameSteps> steps;  ///< absent where the line is unusable
};

Result<MeasuredLine> MeasureLine(const std::filesystem::path& folder, const Scan& scan,
                                 std::size_t index, const FrameSize& size,
                                 const pressure_advance::DeviationOptions& deviation) {
  const ScanLine& line = scan.lines[index];
  const auto frames = ReadFrames(folder, scan, line, size);
  if (!frames) return tl::unexpected(frames.error());
  vision::LaserLineWorkspace workspace;
  pressure_advance::DeviationFrame scratch;
  MeasuredLine measured;
  measured.reading = ReadSweep(*frames, scan, line, {}, workspace);
  measured.paper =
      DeviationHeights(*frames, measured.reading.frame, scan.height_direction, deviation, scratch);
  measured.paper.position_mm = measured.reading.heights.position_mm;
  if (measured.reading.profile.unusable.empty()) {
    measured.steps = StepsOf(index, *frames, measured.reading, deviation);
  }
  return measured;
}

/// As many lines at a time as their cropped frames leave room for.
int LinesAtOnce(const PixelRect& crop) {
  constexpr std::size_t kLongSweepFrames = 1000;
  const std::size_t sweep_bytes = std::size_t{3} * static_cast<std::size_t>(crop.width) *
                                  static_cast<std::size_t>(crop.height) * kLongSweepFrames;
  return static_cast<int>(std::clamp<std::size_t>(kMaxSweepBytes / sweep_bytes, 1, 64));
}

/// All lines, in their order. An error is the first line's that has one, however many threads there
/// are.
Result<std::vector<MeasuredLine>> MeasureLines(
    const std::filesystem::path& folder, const Scan& scan,
    const pressure_advance::DeviationOptions& deviation) {
  const auto size = SizeOf(folder, scan);
  if (!size) return tl::unexpected(size.error());
  std::vector<std::optional<Result<MeasuredLine>>> lines(scan.lines.size());
  std::atomic<int> first_failed = static_cast<int>(lines.size());
  ParallelFor(
      static_cast<int>(lines.size()),
      [&](int i) {
        if (i > first_failed) return;
        const auto index = static_cast<std::size_t>(i);
        lines[index] = MeasureLine(folder, scan, index, *size, deviation);
        int first = first_failed;
        while (!*lines[index] && i < first && !first_failed.compare_exchange_weak(first, i)) {
        }
      },
      LinesAtOnce(*scan.crop));
  std::vector<MeasuredLine> measured;
  for (auto& line : lines) {  // up to the first that failed all are there
    if (!*line) return tl::unexpected(line->error());
    measured.push_back(std::move(**line));
  }
  return measured;
}

}  // namespace

Result<LaserMeasurement> MeasureRecording(const std::filesystem::path& folder,
                                          const pressure_advance::DeviationOptions& deviation) {
  if (auto valid = Validate(deviation); !valid) {
    return tl::unexpected(valid.error());
  }
  auto scan = files::ReadScan(folder);
  if (!scan) {
    return tl::unexpected(scan.error());
  }
  LaserMeasurement result;
  result.scan = std::move(*scan);
  if (!result.scan.crop) {
    if (auto located = LocateCrop(folder, result.scan, result.notices); !located) {
      return tl::unexpected(located.error());
    }
  }
  auto lines = MeasureLines(folder, result.scan, deviation);
  if (!lines) return tl::unexpected(lines.error());
  std::vector<double> pressure_advance_s;
  std::vector<std::optional<double>> scores;
  for (std::size_t i = 0; i < lines->size(); ++i) {
    MeasuredLine& line = (*lines)[i];
    scores.push_back(DeviationScore(line.paper));
    pressure_advance_s.push_back(result.scan.lines[i].pressure_advance_s);
    if (!result.view.steps) result.view.steps = std::move(line.steps);
    AddNotices(result.scan.lines[i], line.reading, result.notices);
    result.profiles.push_back(std::move(line.reading.profile));
    result.view.heights.push_back(std::move(line.reading.heights));
    result.view.paper_heights.push_back(std::move(line.paper));
  }
  result.deviation = pressure_advance::ScoreByDeviation(pressure_advance_s, scores);
  return result;
}

}  // namespace trammel::app
