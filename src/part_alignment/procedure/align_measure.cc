#include "part_alignment/procedure/align_measure.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "base/frame.h"
#include "base/page.h"
#include "machine/net/host_clock.h"
#include "part_alignment/pose/solve.h"
#include "part_alignment/targets/ring_finder.h"
#include "part_alignment/targets/target.h"

namespace trammel::procedure {
namespace {

using part_alignment::FoundTarget;
using part_alignment::FoundTargets;
using part_alignment::Measurement;
using part_alignment::Observation;
using part_alignment::PartTarget;
using part_alignment::RejectedTarget;
using part_alignment::RejectReason;
using part_alignment::View;

constexpr double kPictureLimit_s = 10;

std::string IdOf(int number, const MeasureOptions& options) {
  return options.id_prefix + std::to_string(number);
}

Result<std::set<std::string>> CheckIds(const Measurement& plan, const MeasureOptions& options) {
  std::set<std::string> readable;
  for (std::size_t i = 1; i <= options.book.words.size(); ++i) {
    readable.insert(IdOf(static_cast<int>(i), options));
  }
  std::set<std::string> ids;
  for (const PartTarget& target : plan.targets) {
    if (!readable.contains(target.id)) {
      return Fail(
          fmt::format("target {} of the plan is none of the {}-bit book, whose ids are "
                      "{} … {}: look at the bits and the prefix of the ids",
                      target.id, options.book.bits, IdOf(1, options),
                      IdOf(static_cast<int>(options.book.words.size()), options)));
    }
    ids.insert(target.id);
  }
  return ids;
}

Result<FoundTargets> Read(const machine::CapturedFrame& picture, const Measurement& plan,
                          const MeasureOptions& options,
                          part_alignment::FinderWorkspace& workspace) {
  const auto frame = TRY(machine::DecodeFrame(picture));
  if (frame.width != plan.camera.width_px || frame.height != plan.camera.height_px) {
    return Fail(fmt::format("the picture has {} x {} px, the camera of the plan {} x {}",
                            frame.width, frame.height, plan.camera.width_px, plan.camera.height_px),
                ErrorKind::kMeasurement);
  }
  const Page grey = part_alignment::GreyPicture(frame.width, frame.height, frame.bgr);
  part_alignment::FinderOptions finder = options.finder;
  finder.mirrored = plan.camera.looks_along == part_alignment::LooksAlong::kMinusZ;
  return part_alignment::FindTargets(grey.view(), options.book, finder, workspace);
}

// True if the reason indicates a target: scratches and stains cause the other reasons as well, and
// by the dozen.
bool TellsOfATarget(RejectReason reason) {
  return reason == RejectReason::kMirrored || reason == RejectReason::kWrongCode ||
         reason == RejectReason::kDoubled || reason == RejectReason::kSaturated;
}

void AddObservations(const FoundTargets& found, const std::set<std::string>& ids,
                     const MeasureOptions& options, std::size_t number, MeasureOutcome& outcome) {
  View& view = outcome.measurement.views[number];
  for (const FoundTarget& target : found.targets) {
    if (!target.number) continue;
    const std::string id = IdOf(*target.number, options);
    if (!ids.contains(id)) {
      outcome.notices.push_back(
          fmt::format("view {}: target {} is none of the part's and was left out", number + 1, id));
      continue;
    }
    const double sigma_px =
        std::hypot(std::max(target.sigma_column_px, target.sigma_row_px), options.extra_sigma_px);
    view.observations.push_back({id, target.disc.column_px, target.disc.row_px, sigma_px});
    outcome.discs[number].push_back(target.disc);
  }
  for (const RejectedTarget& rejected : found.rejected) {
    if (!TellsOfATarget(rejected.reason)) continue;
    outcome.notices.push_back(fmt::format(
        "view {}: what looks like a target{} at column {:.0f}, row {:.0f} was rejected, because {}",
        number + 1, rejected.number ? fmt::format(" {}", *rejected.number) : "", rejected.column_px,
        rejected.row_px, part_alignment::WordsFor(rejected.reason)));
  }
  if (view.observations.empty()) {
    outcome.notices.push_back(fmt::format("view {}: no target of the part was found", number + 1));
  }
}

class Measuring {
 public:
  Measuring(const Measurement& plan, const MeasureOptions& options, const MeasurementHooks& shop)
      : plan_(plan), options_(options), shop_(shop) {}

  Result<MeasureOutcome> Run() {
    auto ids = TRY(CheckIds(plan_, options_));
    ids_ = std::move(ids);
    outcome_.measurement = plan_;
    for (View& view : outcome_.measurement.views) view.observations.clear();
    outcome_.discs.resize(plan_.views.size());
    const auto way = TRY(Way());
    const auto taken = [this](std::size_t number, const machine::CapturedFrame& picture) {
      return Look(number, picture);
    };
    TRY(DriveThroughViews(way, plan_.views, shop_, taken));
    const auto& views = outcome_.measurement.views;
    if (std::all_of(views.begin(), views.end(),
                    [](const View& view) { return view.observations.empty(); })) {
      return Fail(
          "no picture shows a target of the part: look at focus, light, the code book's bits and "
          "the ids",
          ErrorKind::kMeasurement);
    }
    return std::move(outcome_);
  }

 private:
  Result<std::vector<Waypoint>> Way() {
    if (shop_.move_to) {
      const auto start_mm = TRY(shop_.stands_at());
      return RouteThrough(start_mm, plan_.views, options_.route);
    }
    std::vector<Waypoint> way;
    for (const View& view : plan_.views) {
      way.push_back({view.spindle_mm, static_cast<int>(way.size())});
    }
    return way;
  }

  Result<void> Look(std::size_t number, const machine::CapturedFrame& picture) {
    auto found = TRY(Read(picture, plan_, options_, workspace_));
    AddObservations(found, ids_, options_, number, outcome_);
    outcome_.found.push_back(std::move(found));
    Measurement so_far = outcome_.measurement;
    so_far.views.resize(number + 1);
    TRY(shop_.keep_observations(so_far));
    shop_.tell(fmt::format("view {} of {}: {} targets", number + 1, plan_.views.size(),
                           outcome_.measurement.views[number].observations.size()));
    return {};
  }

  const Measurement& plan_;
  const MeasureOptions& options_;
  const MeasurementHooks& shop_;
  std::set<std::string> ids_;
  part_alignment::FinderWorkspace workspace_;
  MeasureOutcome outcome_;
};

bool Seen(const View& view, const std::string& id) {
  return std::any_of(view.observations.begin(), view.observations.end(),
                     [&id](const Observation& seen) { return seen.target == id; });
}

// Explains why the target there was rejected; empty if nothing was found there.
std::string Rejected(const FoundTargets& found, const Eigen::Vector2d& pixel) {
  // A ring's parts are within three radii of its middle.
  constexpr double kRadii = 3;
  constexpr double kMin_px = 20;
  for (const part_alignment::RejectedTarget& rejected : found.rejected) {
    const double away_px = std::hypot(rejected.column_px - pixel.x(), rejected.row_px - pixel.y());
    if (away_px > std::max(kMin_px, kRadii * rejected.radius_px)) continue;
    return fmt::format(": what is there was rejected, because {}",
                       part_alignment::WordsFor(rejected.reason));
  }
  return {};
}

}  // namespace

StillPictures::StillPictures(machine::FrameSource& source, double settle_s)
    : source_(source), settle_s_(settle_s) {
  if (source.live()) reader_.emplace(source, kPictureLimit_s);
}

Result<machine::CapturedFrame> StillPictures::Take(const std::stop_token& stop) {
  if (!reader_) {
    auto frame = TRY(source_.Next(kPictureLimit_s, stop));
    if (!frame) {
      return Fail("there is no further picture: one is wanted for each view of the plan",
                  ErrorKind::kMeasurement);
    }
    return std::move(*frame);
  }
  const double settled_s = machine::HostNow() + settle_s_;
  const double end_s = settled_s + kPictureLimit_s;
  while (machine::HostNow() < end_s) {
    auto frame = reader_->NextFrame(end_s - machine::HostNow(), stop);
    if (!frame) return frame;
    const bool told = OnOurClock(*frame);
    // A camera that otherwise reports its exposure times may have been late with this one.
    if (!told && times_are_told_) continue;
    times_are_told_ = told;
    const double taken_s = told ? frame->captured->time_s : frame->arrival_s;
    if (taken_s >= settled_s) return frame;
  }
  return Fail("no picture came after the machine had settled", ErrorKind::kMachine);
}

Result<MeasureOutcome> MeasurePart(const Measurement& plan, const MeasureOptions& options,
                                   const MeasurementHooks& shop) {
  return Measuring(plan, options, shop).Run();
}

std::vector<std::string> MissingTargets(const MeasureOutcome& outcome,
                                        const part_alignment::Alignment& alignment) {
  std::vector<std::string> lines;
  if (alignment.verdict != Verdict::kGood) return lines;
  const part_alignment::Measurement& measurement = outcome.measurement;
  const std::vector<View>& views = measurement.views;
  for (std::size_t i = 0; i < views.size() && i < outcome.found.size(); ++i) {
    for (const PartTarget& target : measurement.targets) {
      if (Seen(views[i], target.id)) continue;
      const auto pixel = part_alignment::ImageOf(measurement, alignment, views[i], target);
      if (!pixel) continue;
      lines.push_back(fmt::format(
          "view {}: target {} should be at column {:.0f}, row {:.0f} and was not read{}", i + 1,
          target.id, pixel->x(), pixel->y(), Rejected(outcome.found[i], *pixel)));
    }
  }
  return lines;
}

}  // namespace trammel::procedure
