#include "procedure/scan_recording.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <utility>

#include "procedure/placed_sweep.h"
#include "store/recording.h"
#include "store/whole_file.h"

namespace trammel::procedure {
namespace {

using nlohmann::json;
using pressure_advance::Scan;
using pressure_advance::ScanLine;
using pressure_advance::ScanSettings;
using pressure_advance::SessionTiming;

Scan DescribeScan(const ScanRequest& request) {
  const ScanSettings& settings = request.settings;
  Scan scan;
  scan.frames_per_s = settings.frames_per_s;
  scan.scan_speed_mm_s = settings.scan_speed_mm_s;
  scan.px_per_mm = settings.px_per_mm;
  scan.laser_angle_rad = settings.laser_angle_deg * std::numbers::pi / 180;
  scan.height_direction = settings.height_direction;
  if (settings.crop_px.size() == 4) {
    const auto whole = [&](std::size_t i) { return static_cast<int>(settings.crop_px[i]); };
    scan.crop = PixelRect{whole(0), whole(1), whole(2), whole(3)};
  }
  scan.line_start_mm = settings.skip_mm;
  scan.motion.segments = request.plan.segments;
  scan.motion.length_mm = request.plan.line_length_mm;
  scan.motion.acceleration_mm_s2 = request.plan.acceleration_mm_s2;
  return scan;
}

json DescribeSweep(const RecordedSweep& sweep) {
  json motion = json::array();
  for (const pressure_advance::LineMove& move : sweep.motion) {
    motion.push_back({{"start_s", move.start_s},
                      {"duration_s", move.duration_s},
                      {"start_mm", move.start_mm},
                      {"start_speed_mm_s", move.start_speed_mm_s},
                      {"acceleration_mm_s2", move.acceleration_mm_s2}});
  }
  return {{"pressure_advance_s", sweep.pressure_advance_s},
          {"video", sweep.video},
          {"print_direction", pressure_advance::ToString(sweep.print_direction)},
          {"clock_sigma_s", sweep.clock_sigma_s},
          {"motion", std::move(motion)}};
}

bool CanBeScored(const std::vector<std::optional<double>>& positions) {
  return std::count_if(positions.begin(), positions.end(),
                       [](const auto& position) { return position.has_value(); }) >= 2;
}

}  // namespace

Result<void> ScanRecording::Begin() { return WriteSweeps(); }

Result<void> ScanRecording::Add(RecordedSweep sweep) {
  for (const machine::CapturedFrame& frame : sweep.frames) {
    our_clock_ =
        our_clock_ && frame.captured && frame.captured->clock == machine::CameraClock::kOurs;
  }
  auto seen = Observe(sweep.frames, sweep.motion);
  if (!seen) return tl::unexpected(seen.error());
  sweep.frames = {};
  recorded_.push_back(std::move(sweep));
  seen_.push_back(std::move(*seen));
  if (auto kept = WriteSweeps(); !kept) return kept;
  return WriteScan();
}

Result<void> ScanRecording::Finish() const {
  constexpr std::size_t kFewest = 2;
  if (placed_ >= kFewest) return {};
  return Fail(
      fmt::format("the frames cannot be tied to the motion: {}; the pictures are kept in {}",
                  not_placed_, request_.folder.string()),
      ErrorKind::kMeasurement);
}

Result<void> ScanRecording::WriteSweeps() const {
  json planned = json::array();
  for (const pressure_advance::PlanLine& line : request_.plan.lines) {
    if (line.pattern == 0) planned.push_back(line.pressure_advance_s);
  }
  json sweeps = json::array();
  for (const RecordedSweep& sweep : recorded_) sweeps.push_back(DescribeSweep(sweep));
  const json text = {{"format", 1},
                     {"kind", "laser_sweeps"},
                     {"started", request_.started},
                     {"camera", request_.camera},
                     {"frames_per_s", request_.settings.frames_per_s},
                     {"scan_speed_mm_s", request_.settings.scan_speed_mm_s},
                     {"planned_pressure_advances_s", std::move(planned)},
                     {"sweeps", std::move(sweeps)}};
  return store::WriteWholeFile(request_.folder / "sweeps.json", text.dump(1) + "\n");
}

// scan.json holds the lines whose frames could be placed; a reader can score no others.
Result<void> ScanRecording::WriteScan() {
  pressure_advance::SweepTimingOptions options;
  options.nominal_frames_per_s = request_.settings.frames_per_s;
  double clock_sigma_s = 0;
  for (const RecordedSweep& sweep : recorded_) {
    clock_sigma_s = std::max(clock_sigma_s, sweep.clock_sigma_s);
  }
  options.arrival_offset = pressure_advance::ClockOffset{0, clock_sigma_s};
  if (our_clock_) options.captured_offset = options.arrival_offset;
  const SessionTiming timing = pressure_advance::MatchSweeps(seen_, options);
  not_placed_ = timing.latency_s.reason();
  if (!timing.latency_s.good()) return {};  // later sweeps may settle it
  Scan scan = DescribeScan(request_);
  json left_out = json::array();
  for (std::size_t i = 0; i < timing.sweeps.size(); ++i) {
    ScanLine line;
    line.pressure_advance_s = recorded_[i].pressure_advance_s;
    line.print_direction = recorded_[i].print_direction;
    line.video = recorded_[i].video;
    line.frame_positions_mm = ScoredPositions(timing.sweeps[i]);
    if (CanBeScored(line.frame_positions_mm)) {
      scan.lines.push_back(std::move(line));
      continue;
    }
    const auto& frames = timing.sweeps[i].frames;
    const auto noted = std::find_if(frames.begin(), frames.end(),
                                    [](const auto& frame) { return !frame.note.empty(); });
    not_placed_ =
        noted == frames.end() ? "no frame was certainly taken at the sweep's speed" : noted->note;
    left_out.push_back({{"video", line.video},
                        {"pressure_advance_s", line.pressure_advance_s},
                        {"why", not_placed_}});
  }
  placed_ = scan.lines.size();
  if (scan.lines.empty()) return {};
  const json extra = {{"x_started", request_.started},
                      {"x_camera", request_.camera},
                      {"x_latency_s", timing.latency_s.quantity().value},
                      {"x_latency_sigma_s", timing.latency_s.quantity().standard_uncertainty},
                      {"x_not_placed", std::move(left_out)},
                      {"x_notices", timing.notices}};
  return store::WriteWholeFile(request_.folder / "scan.json", store::FormatScan(scan, extra));
}

}  // namespace trammel::procedure
