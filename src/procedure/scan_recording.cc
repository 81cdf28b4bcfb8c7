#include "procedure/scan_recording.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <numbers>
#include <numeric>
#include <utility>

#include "files/new_file.h"
#include "procedure/placed_sweep.h"
#include "store/recording.h"

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

std::string WhyNot(const pressure_advance::SweepTiming& sweep) {
  for (const pressure_advance::FrameTiming& frame : sweep.frames) {
    if (!frame.note.empty()) return frame.note;
  }
  return "no frame was certainly taken at the sweep's speed";
}

}  // namespace

Result<void> ScanRecording::Begin() { return WriteSweeps(); }

Result<void> ScanRecording::Add(RecordedSweep sweep) {
  our_clock_ = our_clock_ && std::all_of(sweep.frames.begin(), sweep.frames.end(), OnOurClock);
  auto seen = Observe(sweep.frames, sweep.motion);
  if (!seen) return tl::unexpected(seen.error());
  sweep.frames = {};
  recorded_.push_back(std::move(sweep));
  seen_.push_back(std::move(*seen));
  if (auto kept = WriteSweeps(); !kept) return kept;
  return WriteScan();
}

Result<void> ScanRecording::Finish() const {
  if (placed_ >= 2 && 3 * placed_ > 2 * recorded_.size()) return {};
  return Fail(
      fmt::format(
          "{} of {} lines' frames cannot be tied to the motion: {}; the pictures are kept in "
          "{}",
          recorded_.size() - placed_, recorded_.size(), not_placed_, request_.folder.string()),
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
  return files::WriteWholeFile(request_.folder / "sweeps.json",
                               text.dump(1, ' ', false, json::error_handler_t::replace) + "\n",
                               files::IfThere::kReplace);
}

SessionTiming ScanRecording::Match(const std::vector<std::size_t>& sweeps) const {
  pressure_advance::SweepTimingOptions options;
  options.nominal_frames_per_s = request_.settings.frames_per_s;
  double clock_sigma_s = 0;
  std::vector<pressure_advance::SweepObservation> chosen;
  for (const std::size_t i : sweeps) {
    clock_sigma_s = std::max(clock_sigma_s, recorded_[i].clock_sigma_s);
    chosen.push_back(seen_[i]);
  }
  options.arrival_offset = pressure_advance::ClockOffset{0, clock_sigma_s};
  if (our_clock_) options.captured_offset = options.arrival_offset;
  return pressure_advance::MatchSweeps(chosen, options);
}

// One broken sweep need not spoil all: those that cannot be placed by themselves are left out.
ScanRecording::Placed ScanRecording::Place() const {
  Placed placed;
  placed.used.resize(recorded_.size());
  std::iota(placed.used.begin(), placed.used.end(), 0U);
  placed.timing = Match(placed.used);
  if (placed.timing.latency_s.verdict() != Verdict::kRefused) return placed;
  std::erase_if(placed.used, [&](std::size_t i) {
    const SessionTiming alone = Match({i});
    const bool broken = alone.latency_s.verdict() == Verdict::kRefused;
    if (broken) placed.left_out.emplace_back(i, alone.latency_s.reason());
    return broken;
  });
  if (!placed.used.empty()) placed.timing = Match(placed.used);
  return placed;
}

// scan.json holds the lines whose frames could be placed; a reader can score no others.
Result<void> ScanRecording::WriteScan() {
  Placed placed = Place();
  Scan scan = DescribeScan(request_);
  for (std::size_t k = 0; k < placed.timing.sweeps.size(); ++k) {
    const RecordedSweep& recorded = recorded_[placed.used[k]];
    ScanLine line;
    line.pressure_advance_s = recorded.pressure_advance_s;
    line.print_direction = recorded.print_direction;
    line.video = recorded.video;
    line.frame_positions_mm = ScoredPositions(placed.timing.sweeps[k]);
    if (CanBeScored(line.frame_positions_mm)) {
      scan.lines.push_back(std::move(line));
    } else {
      placed.left_out.emplace_back(placed.used[k], WhyNot(placed.timing.sweeps[k]));
    }
  }
  placed_ = scan.lines.size();
  json left_out = json::array();
  left_out_.clear();
  for (const auto& [i, why] : placed.left_out) {
    not_placed_ = fmt::format("{}: {}", recorded_[i].video, why);
    left_out_.push_back(fmt::format("the line of pressure advance {:g} is left out: {}",
                                    recorded_[i].pressure_advance_s, not_placed_));
    left_out.push_back({{"video", recorded_[i].video},
                        {"pressure_advance_s", recorded_[i].pressure_advance_s},
                        {"why", why}});
  }
  const std::filesystem::path file = request_.folder / "scan.json";
  if (scan.lines.empty()) {
    if (left_out.empty()) not_placed_ = placed.timing.latency_s.reason();
    std::error_code ignored;  // what was placed before is contradicted by now
    std::filesystem::remove(file, ignored);
    return {};
  }
  const json extra = {
      {"x_started", request_.started},
      {"x_camera", request_.camera},
      {"x_latency_s", placed.timing.latency_s.quantity().value},
      {"x_latency_sigma_s", placed.timing.latency_s.quantity().standard_uncertainty},
      {"x_not_placed", std::move(left_out)},
      {"x_notices", placed.timing.notices}};
  return files::WriteWholeFile(file, store::FormatScan(scan, extra), files::IfThere::kReplace);
}

}  // namespace trammel::procedure
