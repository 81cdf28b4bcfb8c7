#include "pressure_advance/commands/laser_recording.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <optional>
#include <span>
#include <system_error>
#include <utility>

#include "base/parallel.h"
#include "pressure_advance/files/recording.h"
#include "pressure_advance/laser/laser_reader.h"
#include "pressure_advance/procedure/recorded_frames.h"

namespace trammel::app {
namespace {

using pressure_advance::Scan;
using pressure_advance::ScanLine;
using procedure::FrameSize;

/// Fills in scan.crop: the recorded one, or else from the middle line, whose bead is likely the
/// most even.
Result<void> LocateCrop(const std::filesystem::path& folder, Scan& scan,
                        std::vector<std::string>& notices) {
  scan.crop = scan.found_crop;
  if (!scan.crop) {
    const ScanLine& line = scan.lines[scan.lines.size() / 2];
    const auto found = TRY(procedure::FindCropIn(folder, scan, line));
    if (!found.crop) {
      return Fail(fmt::format("'{}': {}", line.video, found.fault), ErrorKind::kMeasurement);
    }
    scan.crop = found.crop;
  }
  notices.push_back(fmt::format("crop_px was not given; found {}x{} px at ({}, {})",
                                scan.crop->width, scan.crop->height, scan.crop->x, scan.crop->y));
  return {};
}

// Counts frames without a position between others with one: at either end the head was at rest.
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

/// Result of one sweep.
struct MeasuredLine {
  pressure_advance::SweepReading reading;
  pressure_advance::HeightMap paper;
};

Result<MeasuredLine> MeasureLine(const std::filesystem::path& folder, const Scan& scan,
                                 std::size_t index, const FrameSize& size) {
  const ScanLine& line = scan.lines[index];
  const auto path = TRY(procedure::VideoOf(folder, line));
  const auto frames = TRY(procedure::ReadFrames(path, scan, line, size));
  vision::LaserLineWorkspace workspace;
  MeasuredLine measured;
  measured.reading = ReadSweep(frames, scan, line, {}, workspace);
  measured.paper =
      pressure_advance::DeviationHeights(frames, measured.reading.frame, scan.height_direction);
  measured.paper.position_mm = measured.reading.heights.position_mm;
  return measured;
}

/// Returns the number of lines at a time that fit into memory.
int LinesAtOnce(const PixelRect& crop) {
  constexpr std::size_t kLongSweepFrames = 1000;
  const std::size_t sweep_bytes = std::size_t{3} * static_cast<std::size_t>(crop.width) *
                                  static_cast<std::size_t>(crop.height) * kLongSweepFrames;
  return static_cast<int>(std::clamp<std::size_t>(procedure::kMaxSweepBytes / sweep_bytes, 1, 64));
}

/// Measures all lines, in their order. Returns the error of the first failing line, independent of
/// the number of threads.
Result<std::vector<MeasuredLine>> MeasureLines(const std::filesystem::path& folder,
                                               const Scan& scan) {
  const auto size = TRY(procedure::SizeOf(folder, scan));
  std::vector<std::optional<Result<MeasuredLine>>> lines(scan.lines.size());
  std::atomic<int> first_failed = static_cast<int>(lines.size());
  ParallelFor(
      static_cast<int>(lines.size()),
      [&](int i) {
        if (i > first_failed) return;
        const auto index = static_cast<std::size_t>(i);
        lines[index] = MeasureLine(folder, scan, index, size);
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

Result<LaserMeasurement> MeasureRecording(const std::filesystem::path& folder) {
  auto scan = files::ReadScan(folder);
  if (!scan) {
    return tl::unexpected(scan.error());
  }
  LaserMeasurement result;
  result.scan = std::move(*scan);
  if (!result.scan.crop) {
    TRY(LocateCrop(folder, result.scan, result.notices));
  }
  auto lines = TRY(MeasureLines(folder, result.scan));
  std::vector<double> pressure_advance_s;
  std::vector<std::optional<double>> scores;
  std::vector<pressure_advance::StripeObservation> observations;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    MeasuredLine& line = lines[i];
    scores.push_back(DeviationScore(line.paper));
    pressure_advance_s.push_back(result.scan.lines[i].pressure_advance_s);
    AddNotices(result.scan.lines[i], line.reading, result.notices);
    line.reading.profile.pattern = result.scan.lines[i].pattern;
    observations.push_back(line.reading.observation);
    result.profiles.push_back(std::move(line.reading.profile));
    result.view.heights.push_back(std::move(line.reading.heights));
    result.view.paper_heights.push_back(std::move(line.paper));
  }
  for (std::string& notice :
       pressure_advance::ObservationNotices(observations, result.scan.px_per_mm)) {
    result.notices.push_back(std::move(notice));
  }
  pressure_advance::ShareScatter(result.profiles);
  result.deviation = pressure_advance::ScoreByDeviation(pressure_advance_s, scores);
  return result;
}

}  // namespace trammel::app
