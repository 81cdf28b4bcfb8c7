#include "pressure_advance/commands/refinement.h"

#include <fmt/format.h>

#include <string>
#include <utility>

#include "app/new_folder.h"
#include "pressure_advance/commands/calibration_run.h"
#include "pressure_advance/procedure/plate_layout.h"
#include "pressure_advance/procedure/scan_checks.h"

namespace trammel::app {
namespace {

Result<procedure::CalibrationRequest> PlanRefined(const procedure::Session& session,
                                                  const files::Config& config,
                                                  const Interval& range_s) {
  const auto reach = procedure::ReachOf(session);
  if (!reach) return tl::unexpected(reach.error());
  auto pattern = procedure::RefinedBeside(config.pattern, range_s, config.scan, *reach);
  if (!pattern) return tl::unexpected(pattern.error());
  auto request = RequestFor(config, {});
  request.pattern = std::move(*pattern);
  return request;
}

}  // namespace

Result<void> CheckRoomToRefine(const files::Config& config, const procedure::Reach& reach) {
  constexpr Interval kAny_s{0, 0.1};
  const auto pattern = procedure::RefinedBeside(config.pattern, kAny_s, config.scan, reach);
  if (!pattern) return tl::unexpected(pattern.error());
  return {};
}

Result<Refined> Refine(const procedure::Session& session, const files::Config& config,
                       const std::filesystem::path& first, const Interval& range_s) {
  auto request = PlanRefined(session, config, range_s);
  if (!request) return tl::unexpected(request.error());
  const auto folder = NewFolder::Make(first.string() + "-refined");
  if (!folder) return tl::unexpected(folder.error());
  request->folder = folder->path();
  session.Say(fmt::format("printing a second pattern beside the first, from {:.3g} to {:.3g} s",
                          range_s.lo, range_s.hi));
  const CalibrationRun ran = CalibrateInto(session, *request);
  if (!ran.done) return tl::unexpected(ran.done.error());
  auto run = AnalyseRecording(request->folder, pressure_advance::Method::kResponse);
  if (!run) return tl::unexpected(run.error());
  return Refined{std::move(*run), request->folder, request->pattern};
}

}  // namespace trammel::app
