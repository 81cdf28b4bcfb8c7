#include "pressure_advance/procedure/scan_recording.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <numbers>
#include <numeric>
#include <tuple>
#include <utility>

#include "files/new_file.h"
#include "gcode/bead.h"
#include "pressure_advance/files/recording.h"
#include "pressure_advance/procedure/plate_layout.h"
#include "pressure_advance/procedure/recorded_frames.h"
#include "pressure_advance/response/transitions.h"
#include "pressure_advance/timing/frame_stamps.h"

namespace trammel::procedure {
namespace {

using nlohmann::json;
using pressure_advance::ClockOffset;
using pressure_advance::Scan;
using pressure_advance::ScanLine;
using pressure_advance::SessionTiming;
using settings::ScanSettings;

Scan DescribeScan(const ScanRequest& request) {
  const ScanSettings& settings = request.settings;
  Scan scan;
  scan.frames_per_s = settings.frames_per_s;
  scan.scan_speed_mm_s = settings.scan_speed_mm_s;
  scan.px_per_mm = settings.px_per_mm;
  scan.laser_angle_rad = settings.laser_angle_deg * std::numbers::pi / 180;
  scan.px_per_mm_sigma = settings.px_per_mm_sigma;
  if (settings.laser_angle_sigma_deg) {
    scan.laser_angle_sigma_rad = *settings.laser_angle_sigma_deg * std::numbers::pi / 180;
  }
  scan.height_direction = settings.height_direction;
  if (settings.crop_px.size() == 4) {
    const auto whole = [&](std::size_t i) { return static_cast<int>(settings.crop_px[i]); };
    scan.crop = PixelRect{whole(0), whole(1), whole(2), whole(3)};
  }
  const pressure_advance::PatternPlan& plan = request.plan;
  if (plan.layer_height_mm > 0 && plan.line_width_mm >= plan.layer_height_mm) {
    scan.commanded_area_mm2 = gcode::BeadArea_mm2(plan.line_width_mm, plan.layer_height_mm);
  }
  scan.opaque_plate = settings.opaque_plate;
  scan.line_start_mm = settings.skip_mm;
  scan.motion.segments = request.plan.segments;
  scan.motion.length_mm = request.plan.line_length_mm;
  scan.motion.acceleration_mm_s2 = request.plan.acceleration_mm_s2;
  return scan;
}

Result<pressure_advance::TransitionPlan> PlanLines(const ScanRequest& request) {
  double longest_s = 0;
  for (const pressure_advance::PlanLine& line : request.plan.lines) {
    longest_s = std::max(longest_s, line.pressure_advance_s);
  }
  return pressure_advance::PlanTransitions(DescribeScan(request).motion,
                                           pressure_advance::PositionUnit::kMillimetre, longest_s);
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
  json described = {{"pressure_advance_s", sweep.lines.front().pressure_advance_s},
                    {"video", sweep.video},
                    {"print_direction", ToString(sweep.lines.front().print_direction)},
                    {"clock_sigma_s", sweep.clock_sigma_s},
                    {"motion", std::move(motion)}};
  if (sweep.lines.size() < 2) return described;
  for (const SweptLine& line : sweep.lines) {
    described["lines"].push_back({{"pattern", line.pattern},
                                  {"pressure_advance_s", line.pressure_advance_s},
                                  {"print_direction", ToString(line.print_direction)},
                                  {"begin_mm", line.stretch.begin_mm},
                                  {"end_mm", line.stretch.end_mm},
                                  {"origin_mm", line.stretch.origin_mm},
                                  {"backwards", line.stretch.direction < 0}});
  }
  return described;
}

template <class NotPlaced>
json ListOf(const std::vector<NotPlaced>& all) {
  json list = json::array();
  for (const NotPlaced& one : all) {
    list.push_back(
        {{"video", one.video}, {"pressure_advance_s", one.pressure_advance_s}, {"why", one.why}});
  }
  return list;
}

bool CanBeScored(const std::vector<std::optional<double>>& positions) {
  return std::count_if(positions.begin(), positions.end(),
                       [](const auto& position) { return position.has_value(); }) >= 2;
}

// Puts a cause that the pictures do not show before its effect.
std::string CauseFirst(const std::string& busy, const std::string& reason) {
  return busy.empty() ? reason : fmt::format("{} ({})", busy, reason);
}

std::string WhyNot(const pressure_advance::SweepTiming& sweep) {
  for (const pressure_advance::FrameTiming& frame : sweep.frames) {
    if (!frame.note.empty()) return frame.note;
  }
  return "no frame was certainly taken at the sweep's speed";
}

}  // namespace

ScanRecording::ScanRecording(const ScanRequest& request, std::size_t lines)
    : request_(request), lines_(lines), transitions_(PlanLines(request)) {}

Result<void> ScanRecording::Begin() { return WriteSweeps(); }

Result<void> ScanRecording::Add(RecordedSweep sweep) {
  our_clock_ = our_clock_ && std::all_of(sweep.frames.begin(), sweep.frames.end(), OnOurClock);
  auto seen = TRY(Observe(sweep.frames, sweep.motion));
  sweep.frames = {};
  const ClockOffset clock{0, sweep.clock_sigma_s};
  seen.arrival_offset = clock;
  recorded_.push_back(std::move(sweep));
  seen_.push_back(std::move(seen));
  return Write();
}

Result<void> ScanRecording::SetLastAside() {
  const RecordedSweep& last = recorded_.back();
  for (const SweptLine& line : last.lines) {
    set_aside_.push_back({last.video, line.pressure_advance_s, trouble_.value_or("")});
  }
  recorded_.pop_back();
  seen_.pop_back();
  return Write();
}

std::size_t ScanRecording::recorded_lines() const {
  std::size_t lines = 0;
  for (const RecordedSweep& sweep : recorded_) lines += sweep.lines.size();
  return lines;
}

Result<void> ScanRecording::Finish() const {
  if (placed() >= 2 && 3 * placed() > 2 * recorded_lines()) return {};
  const std::string kept = "the pictures are kept in " + request_.folder.string();
  if (not_placed_.empty()) {
    return Fail("nothing was recorded; " + kept, ErrorKind::kMeasurement);
  }
  const NotPlaced& last = not_placed_.back();
  const std::string remedy =
      last.busy ? fmt::format("; {}", pressure_advance::kBusyComputerRemedy) : "";
  return Fail(fmt::format("{}: {}: the frames of {} of {} lines cannot be tied to the motion; {}{}",
                          last.video, last.why, recorded_lines() - placed(), recorded_lines(), kept,
                          remedy),
              ErrorKind::kMeasurement);
}

// The content is known before the first byte is written, so that a full disk changes neither file.
Result<void> ScanRecording::Write() {
  PlaceAll();
  FindCrop();
  TRY(WriteSweeps());
  return WriteScan();
}

// Done once, in the line that an analysis of the whole recording would use.
void ScanRecording::FindCrop() {
  if (!scan_.crop && !crop_sought_ && scan_.lines.size() > lines_ / 2) {
    crop_sought_ = true;
    const auto found = FindCropIn(request_.folder, scan_, scan_.lines[lines_ / 2]);
    if (found) found_crop_ = found->crop;
  }
  scan_.found_crop = found_crop_;
}

Result<void> ScanRecording::WriteSweeps() const {
  json planned = json::array();
  for (const pressure_advance::PlanLine& line : request_.plan.lines) {
    if (line.pattern == 0) planned.push_back(line.pressure_advance_s);
  }
  json sweeps = json::array();
  for (std::size_t i = 0; i < recorded_.size(); ++i) {
    sweeps.push_back(DescribeSweep(recorded_[i]));
    json& changes = sweeps.back()["frame_changes"] = json::array();
    for (const pressure_advance::FrameObservation& frame : seen_[i].frames) {
      changes.push_back(frame.change ? json(*frame.change) : json(nullptr));
    }
    const auto lateness =
        pressure_advance::MeasureLateness(seen_[i], request_.settings.frames_per_s);
    sweeps.back()["late_s"] = lateness.late_s;
    sweeps.back()["lost_frames"] = lateness.lost;
  }
  const json text = {{"format", 1},
                     {"kind", "laser_sweeps"},
                     {"started", request_.started},
                     {"camera", request_.camera},
                     {"frames_per_s", request_.settings.frames_per_s},
                     {"scan_speed_mm_s", request_.settings.scan_speed_mm_s},
                     {"planned_pressure_advances_s", std::move(planned)},
                     {"sweeps", std::move(sweeps)},
                     {"not_placed", ListOf(not_placed_)},
                     {"swept_again", ListOf(set_aside_)}};
  return files::WriteWholeFile(request_.folder / "sweeps.json",
                               text.dump(1, ' ', false, json::error_handler_t::replace) + "\n",
                               files::IfThere::kReplace);
}

SessionTiming ScanRecording::Match(const std::vector<std::size_t>& sweeps) const {
  std::vector<pressure_advance::SweepObservation> chosen;
  for (const std::size_t i : sweeps) {
    chosen.push_back(seen_[i]);
    if (our_clock_) chosen.back().captured_offset = chosen.back().arrival_offset;
  }
  return pressure_advance::MatchSweeps(chosen, request_.settings.frames_per_s);
}

// Omits sweeps that cannot be placed alone, so that a broken one does not spoil all.
ScanRecording::Placed ScanRecording::Place() const {
  constexpr double kRoughestClock_s = 0.03;  // about one frame period
  Placed placed;
  for (std::size_t i = 0; i < recorded_.size(); ++i) {
    if (recorded_[i].clock_sigma_s <= kRoughestClock_s) {
      placed.used.push_back(i);
      continue;
    }
    placed.left_out.emplace_back(
        i,
        fmt::format("the printer's clock was told to {:.0f} ms only (standard uncertainty): this "
                    "computer, or the printer's, is too busy",
                    1e3 * recorded_[i].clock_sigma_s));
  }
  if (placed.used.empty()) return placed;
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

std::string ScanRecording::BusyComputer(const std::vector<std::size_t>& sweeps) const {
  pressure_advance::Lateness worst;
  for (const std::size_t i : sweeps) {
    const auto one = pressure_advance::MeasureLateness(seen_[i], request_.settings.frames_per_s);
    if (one.late_s > worst.late_s || one.lost > worst.lost) worst = one;
  }
  return NameBusyComputer(worst);
}

// A line with a gap remains: readers of heights only can use it.
void ScanRecording::NameGap(std::size_t sweep, const pressure_advance::ScanLine& line) {
  if (!transitions_) return;
  const std::string gap =
      pressure_advance::NameUnseenStretch(line.frame_positions_mm, *transitions_);
  if (gap.empty()) return;
  const std::string why = CauseFirst(BusyComputer({sweep}), gap);
  left_out_.push_back(fmt::format("the line of pressure advance {:g} cannot be read: {}: {}",
                                  line.pressure_advance_s, line.video, why));
  if (sweep + 1 == recorded_.size()) trouble_ = why;
}

void ScanRecording::PlaceAll() {
  Placed placed = Place();
  timing_ = std::move(placed.timing);
  scan_ = DescribeScan(request_);
  not_placed_.clear();
  left_out_.clear();
  trouble_.reset();
  std::vector<Missing> missing;
  for (std::size_t k = 0; k < timing_.sweeps.size(); ++k) {
    const std::size_t sweep = placed.used[k];
    const auto lateness =
        pressure_advance::MeasureLateness(seen_[sweep], request_.settings.frames_per_s);
    for (std::size_t i = 0; i < recorded_[sweep].lines.size(); ++i) {
      const SweptLine& swept = recorded_[sweep].lines[i];
      ScanLine line;
      line.pattern = swept.pattern;
      line.pressure_advance_s = swept.pressure_advance_s;
      line.print_direction = swept.print_direction;
      line.video = recorded_[sweep].video;
      line.late_s = lateness.late_s;
      line.lost_frames = lateness.lost;
      line.frame_positions_mm = ScoredPositions(timing_.sweeps[k], swept.stretch);
      if (CanBeScored(line.frame_positions_mm)) {
        NameGap(sweep, line);
        scan_.lines.push_back(std::move(line));
      } else {
        missing.push_back({sweep, i, WhyNot(timing_.sweeps[k])});
      }
    }
  }
  const auto miss = [&](std::size_t sweep, const std::string& why) {
    for (std::size_t i = 0; i < recorded_[sweep].lines.size(); ++i) {
      missing.push_back({sweep, i, why});
    }
  };
  for (const auto& [sweep, why] : placed.left_out) miss(sweep, why);
  if (timing_.sweeps.empty()) {  // they contradict each other
    for (const std::size_t sweep : placed.used) miss(sweep, timing_.latency_s.reason());
  }
  std::sort(missing.begin(), missing.end(), [](const Missing& a, const Missing& b) {
    return std::tie(a.sweep, a.line) < std::tie(b.sweep, b.line);
  });
  NameMissing(missing);
}

void ScanRecording::NameMissing(const std::vector<Missing>& missing) {
  std::vector<std::size_t> all(recorded_.size());
  std::iota(all.begin(), all.end(), 0U);
  for (const auto& [sweep, i, reason] : missing) {
    const double pressure_advance_s = recorded_[sweep].lines[i].pressure_advance_s;
    const std::string& video = recorded_[sweep].video;
    const std::string busy = BusyComputer(timing_.sweeps.empty() ? all : std::vector{sweep});
    const std::string why = CauseFirst(busy, reason);
    not_placed_.push_back({video, pressure_advance_s, why, !busy.empty()});
    left_out_.push_back(fmt::format("the line of pressure advance {:g} is left out: {}: {}",
                                    pressure_advance_s, video, why));
    // Too few data of one line may suffice with more lines.
    const bool too_few = timing_.latency_s.verdict() == Verdict::kCannotTell;
    if (sweep + 1 == recorded_.size() && !too_few) trouble_ = why;
  }
}

// scan.json contains the lines with placed frames; a reader can score no others.
Result<void> ScanRecording::WriteScan() {
  const std::filesystem::path file = request_.folder / "scan.json";
  if (scan_.lines.empty()) {
    std::error_code ignored;  // earlier placements are now contradicted
    std::filesystem::remove(file, ignored);
    safe_ = 0;
    return {};
  }
  const json extra = {{"x_started", request_.started},
                      {"x_camera", request_.camera},
                      {"x_latency_s", timing_.latency_s.quantity().value},
                      {"x_latency_sigma_s", timing_.latency_s.quantity().standard_uncertainty},
                      {"x_not_placed", ListOf(not_placed_)},
                      {"x_notices", timing_.notices}};
  auto written =
      files::WriteWholeFile(file, files::FormatScan(scan_, extra), files::IfThere::kReplace);
  if (written) safe_ = scan_.lines.size();
  return written;
}

}  // namespace trammel::procedure
