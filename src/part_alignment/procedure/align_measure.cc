#include "part_alignment/procedure/align_measure.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "base/frame.h"
#include "base/page.h"
#include "part_alignment/targets/grey_picture.h"
#include "part_alignment/targets/reject_words.h"

namespace trammel::procedure {
namespace {

using part_alignment::FoundTarget;
using part_alignment::FoundTargets;
using part_alignment::Measurement;
using part_alignment::PartTarget;
using part_alignment::RejectedTarget;
using part_alignment::RejectReason;
using part_alignment::View;

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

// The others are said of scratches and stains as well, and by the dozen.
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

}  // namespace

Result<MeasureOutcome> MeasurePart(const Measurement& plan, const MeasureOptions& options,
                                   const MeasurementHooks& shop) {
  return Measuring(plan, options, shop).Run();
}

}  // namespace trammel::procedure
