#include "part_alignment/board/board_calibration.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "base/statistics.h"
#include "geometry/euler.h"
#include "geometry/linear_systems.h"
#include "part_alignment/board/board_adjust.h"
#include "part_alignment/board/board_answer.h"
#include "part_alignment/board/board_input.h"
#include "part_alignment/board/board_start.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr std::size_t kMinViews = 8;
constexpr std::size_t kMinMarks = 6;
constexpr double kMaxWrong = 0.05;  // share of pictures or observations
constexpr int kIterations = 60;

BoardCalibration& SetVerdict(Verdict verdict, std::string reason, BoardCalibration& result) {
  result.verdict = verdict;
  result.reason = std::move(reason);
  return result;
}

// Finds pictures of another size than the camera's.
std::optional<std::string> SizeFault(const BoardMeasurement& measurement) {
  for (std::size_t i = 0; i < measurement.views.size(); ++i) {
    const BoardView& view = measurement.views[i];
    if (view.width_px == 0 || (view.width_px == measurement.camera.width_px &&
                               view.height_px == measurement.camera.height_px)) {
      continue;
    }
    return fmt::format(
        "{} has {} x {} px, the camera {} x {}: a calibration holds for one camera with one "
        "picture size, uncropped; take all pictures with that",
        NameOf(measurement, i), view.width_px, view.height_px, measurement.camera.width_px,
        measurement.camera.height_px);
  }
  return std::nullopt;
}

// @param first  from a first guess
void Adjust(BoardWork& work, bool first = false) {
  BoardNetwork& network = work.pieces.network;
  work.fit = first ? AdjustFirst(work.held, kIterations, network, work.state)
                   : AdjustBoard(network, work.held, kIterations, work.state);
  if (std::isfinite(work.fit.cost)) work.precision = PrecisionOf(network, work.state, work.held);
}

double PixelRoot(const BoardWork& work) {
  return std::sqrt(work.precision.pixel_square / std::max(1.0, work.precision.pixel_redundancy));
}

// Scales the sigmas of observations and of the machine to their scatter (Helmert's estimate).
void FitSigmas(BoardWork& work) {
  BoardNetwork& network = work.pieces.network;
  constexpr double kMinFactor = 1;  // sigmas are at least the stated ones
  constexpr double kEnoughFreedom = 20;
  for (int round = 0; round < 4; ++round) {
    const double root = PixelRoot(work);
    const double factor = std::max(kMinFactor / work.pixel_factor, root);
    const bool placed = work.precision.place_redundancy > kEnoughFreedom;
    // Includes the ratio of Student's t standard deviation to the normal distribution's.
    const double freedom = work.precision.place_redundancy;
    const double places = placed ? std::sqrt(work.precision.place_square / (freedom - 2)) : 1;
    for (NetworkObservation& observation : network.observations) observation.sigma_px *= factor;
    work.pixel_factor *= factor;
    constexpr double kMin_mm = 1e-4;
    const double machine_mm = std::clamp(network.machine.repeatability_mm * places, kMin_mm, 10.0);
    const bool same = std::abs(factor - 1) < 1e-3 &&
                      std::abs(machine_mm / network.machine.repeatability_mm - 1) < 1e-2;
    network.machine.repeatability_mm = machine_mm;
    Adjust(work);
    if (same || !work.fit.converged) return;
  }
}

// Drops observations far from the position that all others predict; false if there are too many.
bool DropWrongObservations(double false_alarm, BoardWork& work, std::size_t& dropped) {
  BoardNetwork& network = work.pieces.network;
  std::vector<double> lengths;
  std::vector<std::size_t> of;
  for (std::size_t i = 0; i < network.observations.size(); ++i) {
    const NetworkObservation& observation = network.observations[i];
    if (!TakesPart(network, observation)) continue;
    const auto residual = ResidualOf(network, work.state, observation);
    lengths.push_back(residual ? residual->norm() / observation.sigma_px
                               : std::numeric_limits<double>::infinity());
    of.push_back(i);
  }
  if (lengths.empty()) return false;
  // The length of two standard normal numbers exceeds x in exp(-x²/2) of the cases.
  const double wrong_sigma =
      std::sqrt(2 * std::log(static_cast<double>(lengths.size()) / false_alarm));
  const double scale = std::max(0.05, Median(lengths) / 1.177);
  const double worst = *std::max_element(lengths.begin(), lengths.end());
  if (!(worst > wrong_sigma * scale)) return true;
  const double limit = std::max(wrong_sigma * scale, worst / 2);
  for (std::size_t k = 0; k < of.size(); ++k) {
    if (!(lengths[k] > limit)) continue;
    network.observations[of[k]].used = false;
    work.rejected[of[k]] = true;
    ++dropped;
  }
  LeaveOutLonely(network);
  Adjust(work);
  return static_cast<double>(dropped) <=
         kMaxWrong * static_cast<double>(network.observations.size());
}

// Finds the picture whose place contradicts the others most; absent if none does.
std::optional<std::size_t> WrongPlace(const BoardWork& work, double false_alarm) {
  const BoardNetwork& network = work.pieces.network;
  const double prior = std::pow(network.machine.repeatability_mm, 2);
  std::vector<double> tests(network.stations.size(), 0);
  std::vector<double> used;
  for (std::size_t i = 0; i < network.stations.size(); ++i) {
    if (!network.stations[i].used) continue;
    // Margin against rounding where the pictures hardly determine a position.
    constexpr double kRounding = 1e-3;
    const Matrix3d covariance =
        (1 + kRounding) * prior * Matrix3d::Identity() - work.precision.off_covariance[i];
    tests[i] = work.state.off_mm[i].dot(
        geometry::SolveLeastSquares(covariance, work.state.off_mm[i]).col(0));
    used.push_back(tests[i]);
  }
  if (used.empty()) return std::nullopt;
  const double scale = std::max(1.0, Median(used) / ChiSquareQuantile(0.5, 3));
  const auto worst = std::max_element(tests.begin(), tests.end());
  const double limit =
      ChiSquareQuantile(1 - false_alarm / static_cast<double>(used.size()), 3) * scale;
  if (!(*worst > limit)) return std::nullopt;
  return static_cast<std::size_t>(worst - tests.begin());
}

void NoteViews(const BoardMeasurement& measurement, BoardCalibration& result) {
  for (std::size_t i = 0; i < measurement.views.size(); ++i) {
    BoardViewResult& view = result.views.emplace_back();
    view.picture = NameOf(measurement, i);
    view.observations = static_cast<int>(measurement.views[i].observations.size());
    if (view.observations == 0) view.reason = "shows no mark";
  }
}

void NoteUnused(const BoardNetwork& network, BoardCalibration& result) {
  std::vector<std::string> empty;
  std::vector<std::string> few;
  for (std::size_t i = 0; i < result.views.size(); ++i) {
    BoardViewResult& view = result.views[i];
    view.used = network.stations[i].used;
    if (view.used) continue;
    if (view.reason.empty()) {
      view.reason = fmt::format("shows fewer than {} marks that others show", kMinMarksInView);
      few.push_back(view.picture);
    } else if (view.observations == 0) {
      empty.push_back(view.picture);
    }
  }
  const auto say = [&](const std::vector<std::string>& names, const std::string& why) {
    if (names.empty()) return;
    constexpr std::size_t kShown = 10;
    const std::vector<std::string> shown(
        names.begin(), names.begin() + static_cast<long>(std::min(names.size(), kShown)));
    result.notices.push_back(
        fmt::format("{}{} {}", fmt::join(shown, ", "), names.size() > kShown ? ", …" : "", why));
  };
  say(empty, "left out: no mark is in it");
  say(few, fmt::format("left out: fewer than {} marks that others show", kMinMarksInView));
}

constexpr const char* kHeightsAlike =
    ": the focal length and the distance cannot be told apart from heights so much alike; take "
    "pictures from heights of 1 : 2 above the board, at each from all over it";

// Checks the start before any adjustment; true if it refuses and the result has the reason.
bool RefuseStart(const BoardStart& start, BoardCalibration& result) {
  const std::string heights =
      fmt::format("the spindle's heights span {:.3g} mm and its places across {:.3g} mm",
                  start.depth_mm, start.width_mm);
  switch (start.fault) {
    case BoardStartFault::kNone:
      return false;
    case BoardStartFault::kFewPictures:
      SetVerdict(Verdict::kCannotTell,
                 "fewer than 4 pictures at any one angle of the spindle: take 20 or more at each",
                 result);
      break;
    case BoardStartFault::kOneLine:
      SetVerdict(
          Verdict::kCannotTell,
          "the spindle moves along one line: focal length, place and angles of the camera cannot "
          "be told apart; move it along X, Y and Z",
          result);
      break;
    case BoardStartFault::kOneHeight:
    case BoardStartFault::kShallow:
      SetVerdict(Verdict::kCannotTell, heights + kHeightsAlike, result);
      break;
    case BoardStartFault::kMirrored:
      SetVerdict(
          Verdict::kRefused,
          "the pictures are the mirror image of what a camera sees from these places: check the "
          "signs and the order of the table's axes, and looks_along",
          result);
      break;
    case BoardStartFault::kLooksAway:
      SetVerdict(Verdict::kRefused,
                 "with these places the camera would look into the spindle: check the signs of the "
                 "table's axes, and spindle_rotation",
                 result);
      break;
    case BoardStartFault::kNoCamera:
      SetVerdict(
          Verdict::kRefused,
          "no camera sees the board so from these places: the table of places does not belong to "
          "the pictures, or pictures of two cameras are mixed; check the order, units and signs of "
          "the table",
          result);
      break;
  }
  return true;
}

bool Turns(const BoardMeasurement& measurement) {
  const Matrix3d& first = measurement.views.front().spindle_rotation;
  return std::any_of(
      measurement.views.begin(), measurement.views.end(),
      [&](const BoardView& view) { return !view.spindle_rotation.isApprox(first, 1e-6); });
}

// Computes the residuals of an adjustment from scratch, without touches, in their sigmas (root mean
// square); infinite if there is none.
double RootOf(const BoardMeasurement& measurement) {
  BoardPieces pieces = PiecesOf(measurement);
  BoardNetwork& network = pieces.network;
  network.touches.clear();
  network.place.reset();
  BoardStart start = StartBoard(network);
  if (start.fault != BoardStartFault::kNone) return std::numeric_limits<double>::infinity();
  UseStart(start, network);
  HeldUnknowns held(static_cast<std::size_t>(SharedUnknowns(network)), false);
  held[9] = true;
  held[kBoardTool] = true;
  if (!Turns(measurement)) held[7] = held[8] = true;
  constexpr int kFewIterations = 25;
  const DescentEnd fit = AdjustFirst(held, kFewIterations, network, start.state);
  int observations = 0;
  for (const NetworkObservation& observation : network.observations) {
    observations += TakesPart(network, observation) ? 1 : 0;
  }
  const double freedom = 2.0 * observations - 3.0 * static_cast<double>(network.marks) - 20;
  if (!(freedom > 0)) return std::numeric_limits<double>::infinity();
  return std::sqrt(fit.cost / freedom);
}

// Lists the pictures with the largest residuals.
std::string LargestResiduals(const BoardMeasurement& measurement, const BoardWork& work) {
  const BoardNetwork& network = work.pieces.network;
  std::vector<double> squares(network.stations.size(), 0);
  std::vector<int> counts(network.stations.size(), 0);
  for (const NetworkObservation& observation : network.observations) {
    if (!TakesPart(network, observation)) continue;
    const auto residual = ResidualOf(network, work.state, observation);
    if (!residual) continue;
    squares[observation.station] += residual->squaredNorm();
    ++counts[observation.station];
  }
  std::vector<std::pair<double, std::size_t>> rms_px;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    if (counts[i] > 0) rms_px.emplace_back(std::sqrt(squares[i] / (2.0 * counts[i])), i);
  }
  std::sort(rms_px.rbegin(), rms_px.rend());
  constexpr std::size_t kNamed = 3;
  std::vector<std::string> named;
  for (const auto& [px, view] : std::span(rms_px).first(std::min(kNamed, rms_px.size()))) {
    named.push_back(fmt::format("{} ({:.3g} px)", NameOf(measurement, view), px));
  }
  return fmt::format("{}", fmt::join(named, ", "));
}

std::string KindText(BoardChangeKind kind) {
  switch (kind) {
    case BoardChangeKind::kBoard:
      return "the board moved";
    case BoardChangeKind::kCamera:
      return "the camera was moved in its holder";
    case BoardChangeKind::kLens:
      return "the lens was touched (focus, zoom), or another camera took over";
  }
  return {};
}

std::string SizeText(const BoardChange& change, const Camera& camera) {
  if (change.kind == BoardChangeKind::kLens) {
    return fmt::format("focal length {:+.3g} %, principal point {:+.2f}, {:+.2f} px",
                       100 * change.by[0] / camera.focal_length_mm, change.by[1], change.by[2]);
  }
  return fmt::format("by {:.3g} mm and {:.3g} mrad", change.by.head<3>().norm(),
                     1e3 * change.by.tail<3>().norm());
}

// Names the change that explains the misfit, and all others that explain it as well.
std::string ChangeText(const BoardMeasurement& measurement, const Camera& camera,
                       std::vector<BoardChange> changes) {
  std::sort(changes.begin(), changes.end(),
            [](const auto& a, const auto& b) { return a.statistic > b.statistic; });
  std::string words;
  for (const BoardChange& change : changes) {
    constexpr double kAsGood = 0.7;
    if (change.statistic < kAsGood * changes.front().statistic) continue;
    words += fmt::format("{}{} before {} ({})", words.empty() ? "" : ", or ", KindText(change.kind),
                         NameOf(measurement, change.first_after), SizeText(change, camera));
  }
  return words;
}

// True if the data on each side of a change are sound by themselves.
bool SplitsAt(const BoardMeasurement& measurement, std::size_t first_after, double root) {
  BoardMeasurement before = measurement;
  BoardMeasurement after = measurement;
  const auto cut = static_cast<long>(first_after);
  before.views.erase(before.views.begin() + cut, before.views.end());
  after.views.erase(after.views.begin(), after.views.begin() + cut);
  if (before.views.size() < kMinViews || after.views.size() < kMinViews) return false;
  constexpr double kBetter = 1.7;
  return RootOf(before) < root / kBetter && RootOf(after) < root / kBetter;
}

// Finds a machine error far beyond its stated size.
std::optional<std::string> PriorFault(const BoardWork& work) {
  constexpr double kBeyond = 6;  // sigmas
  const BoardNetwork& network = work.pieces.network;
  const Eigen::VectorXd shared = SharedOf(network, work.state);
  Index worst = 0;
  double most = kBeyond;
  for (Index i = kBoardScale; i < shared.size(); ++i) {
    const double sigma = PriorSigma(network, i);
    if (!(sigma > 0) || !(std::abs(shared[i]) > most * sigma)) continue;
    most = std::abs(shared[i]) / sigma;
    worst = i;
  }
  if (worst == 0) return std::nullopt;
  const double value = shared[worst];
  std::string what = "the spindle's angle is {:.3g} rad off where it is stated (index_rad)";
  if (worst < kBoardSquare) {
    what = fmt::format("{}'s scale is off by {{:.3g}} (scale)", "XYZ"[worst - kBoardScale]);
  } else if (worst < kBoardLean) {
    what = "two axes are {:.3g} rad off a right angle (squareness_rad)";
  } else if (worst < kBoardTool) {
    what = "the spindle's axis leans by {:.3g} rad (lean_rad)";
  } else if (worst < kBoardStays) {
    what = "the tool is {:.3g} mm longer than stated (tool_length_sigma_mm)";
  }
  return fmt::format(fmt::runtime(what), value) +
         fmt::format(", {:.3g} times what is stated of it", most);
}

// Reports a fit whose residuals are beyond reason, or that requires a machine beyond its stated
// errors.
void NameMisfit(const BoardMeasurement& measurement, double max_residual_sigma,
                const BoardWork& work, BoardCalibration& result) {
  constexpr double kBeyond = 1e6;  // sigmas: there is no adjustment at all
  const double root = std::min(RootOf(measurement), kBeyond);
  const std::string head = fmt::format(
      "pictures and places do not fit one board and one camera (residuals of {:.3g} stated sigmas "
      "in all): ",
      root);
  if (std::isfinite(work.fit.cost)) {
    auto changes = FindChanges(work.pieces.network, work.state, work.precision, kMinViews / 2);
    std::erase_if(changes, [&](const BoardChange& change) {
      return change.freedom == 0 || !SplitsAt(measurement, change.first_after, root);
    });
    if (!changes.empty()) {
      SetVerdict(Verdict::kRefused,
                 head + ChangeText(measurement, work.state.camera, changes) +
                     "; take the pictures anew, with board, camera and focus at rest",
                 result);
      return;
    }
    const auto fault = PriorFault(work);
    if (fault && PixelRoot(work) * work.pixel_factor < max_residual_sigma) {
      SetVerdict(Verdict::kRefused, head + *fault + "; state it larger if the machine is so",
                 result);
      return;
    }
  }
  if (!(root < kBeyond) && work.shallow) {
    SetVerdict(Verdict::kCannotTell,
               "the spindle's heights span little" + std::string(kHeightsAlike), result);
    return;
  }
  const std::string largest =
      std::isfinite(work.fit.cost) ? LargestResiduals(measurement, work) : std::string();
  SetVerdict(
      Verdict::kRefused,
      head +
          (largest.empty() ? "" : fmt::format("the largest residuals are those of {}; ", largest)) +
          "the table does not belong to the pictures, pictures of two cameras are mixed, or "
          "several things moved; check order, units and signs of the table and that all pictures "
          "are of one camera",
      result);
}

bool NeedsMore(const BoardMeasurement& measurement, const BoardNetwork& network,
               BoardCalibration& result) {
  std::size_t views = 0;
  for (const BoardNetwork::Station& station : network.stations) views += station.used ? 1 : 0;
  const std::vector<bool> seen = SeenMarks(network);
  const auto marks = static_cast<std::size_t>(std::count(seen.begin(), seen.end(), true));
  if (views >= kMinViews && marks >= kMinMarks) return false;
  SetVerdict(
      Verdict::kCannotTell,
      fmt::format("{} of {} pictures show {} marks that others show as well; at least {} pictures "
                  "and {} marks are needed, and 40 and 20 are good",
                  views, measurement.views.size(), marks, kMinViews, kMinMarks),
      result);
  return true;
}

// Corrects the discs' centres for perspective and lens, by the current camera and board.
void CorrectDiscs(BoardWork& work) {
  const auto corrected = CorrectedCentres(work);
  for (std::size_t i = 0; i < corrected.size(); ++i) {
    work.pieces.network.observations[i].pixel = corrected[i];
  }
  Adjust(work);
}

// Drops wrong observations and wrongly stated places, one after the other; false if there are too
// many.
bool LeaveOutWrong(const BoardMeasurement& measurement, const BoardCalibrateOptions& options,
                   BoardWork& work, BoardCalibration& result) {
  std::size_t dropped = 0;
  std::size_t wrong_places = 0;
  const auto max_places = static_cast<std::size_t>(
      std::ceil(kMaxWrong * static_cast<double>(measurement.views.size())));
  for (int round = 0; round < 100; ++round) {
    const std::size_t before = dropped;
    if (!DropWrongObservations(options.false_alarm, work, dropped) || !std::isfinite(work.fit.cost))
      return false;
    if (dropped > before) continue;
    const auto wrong = WrongPlace(work, options.false_alarm);
    if (!wrong) break;
    if (++wrong_places > max_places) return false;
    const Vector3d off = work.state.off_mm[*wrong];
    result.views[*wrong].reason =
        fmt::format("was taken {:.3f}, {:.3f}, {:.3f} mm beside its place in the table", off.x(),
                    off.y(), off.z());
    result.notices.push_back(result.views[*wrong].picture + " left out: it " +
                             result.views[*wrong].reason);
    for (std::size_t i = 0; i < work.rejected.size(); ++i) {
      const NetworkObservation& observation = work.pieces.network.observations[i];
      if (observation.station == *wrong && observation.used) work.rejected[i] = true;
    }
    work.pieces.network.stations[*wrong].used = false;
    work.state.off_mm[*wrong].setZero();
    LeaveOutLonely(work.pieces.network);
    Adjust(work);
  }
  if (dropped > 0) {
    result.notices.push_back(
        fmt::format("{} of {} marks in pictures left out: beside where all others put them",
                    dropped, work.pieces.network.observations.size()));
  }
  return true;
}

bool Misfits(const BoardWork& work, const BoardCalibrateOptions& options) {
  if (!work.fit.converged || !std::isfinite(work.fit.cost)) return true;
  const double places =
      std::sqrt(work.precision.place_square / std::max(1.0, work.precision.place_redundancy));
  constexpr double kMaxPlaces = 25;  // times what is stated
  return PixelRoot(work) > 4 * options.max_residual_sigma || places > kMaxPlaces;
}

// Adjusts with large machine uncertainty, so that a wrong row is distinct; then as stated, without
// those rows. False if too many are wrong.
bool SettleLoosely(const BoardMeasurement& measurement, const BoardCalibrateOptions& options,
                   BoardWork& work, BoardCalibration& result) {
  double& repeatability_mm = work.pieces.network.machine.repeatability_mm;
  const double stated_mm = repeatability_mm;
  constexpr double kLoose_mm = 1;
  repeatability_mm = std::max(stated_mm, kLoose_mm);
  Adjust(work, true);
  if (!std::isfinite(work.fit.cost) || !LeaveOutWrong(measurement, options, work, result)) {
    return false;
  }
  repeatability_mm = stated_mm;
  Adjust(work);
  return std::isfinite(work.fit.cost) && LeaveOutWrong(measurement, options, work, result);
}

// Refuses a change during the measurement, or widens the covariance by its possible effect.
bool RefuseChange(const BoardMeasurement& measurement, const BoardCalibrateOptions& options,
                  const BoardWork& work, CameraCovariance& covariance, BoardCalibration& result) {
  auto changes = FindChanges(work.pieces.network, work.state, work.precision, 3);
  const auto views = static_cast<double>(measurement.views.size());
  std::erase_if(changes, [&](const BoardChange& change) {
    return change.freedom == 0 ||
           change.statistic <
               ChiSquareQuantile(1 - options.false_alarm / (3 * views), change.freedom);
  });
  if (changes.empty()) return false;
  // Compares the effect on the camera with the camera's uncertainty.
  double most = 0;
  CameraVector influence = CameraVector::Zero();
  for (const BoardChange& change : changes) {
    for (Index i = 0; i < kCameraParameters; ++i) {
      if (!(covariance(i, i) > 0)) continue;
      const double share = std::abs(change.influence[i]) / std::sqrt(covariance(i, i));
      if (share > most) {
        most = share;
        influence = change.influence;
      }
    }
  }
  const std::string words = ChangeText(measurement, work.state.camera, changes);
  constexpr double kHarmless = 1;  // sigma of any parameter
  if (most > kHarmless) {
    SetVerdict(
        Verdict::kRefused,
        words +
            fmt::format(
                ": the camera's parameters are off by up to {:.2g} of their sigmas by that; take "
                "the pictures anew, with board, camera and focus at rest and the machine warm",
                most),
        result);
    return true;
  }
  covariance += influence * influence.transpose();
  result.notices.push_back(words +
                           ", or the machine warmed up: what that does was added to the "
                           "covariance");
  return false;
}

// Adjusts again with touches and stated place; true if they contradict.
bool RefuseStated(const BoardCalibrateOptions& options, BoardStated stated, BoardWork& work,
                  BoardCalibration& result) {
  BoardNetwork& network = work.pieces.network;
  JoinStated(std::move(stated), network);
  work.told = ToldOf(network);
  work.held = HeldOf(network, work.told);
  PlaceByStated(network, work.told, work.state);
  Adjust(work);
  if (!work.fit.converged || !std::isfinite(work.fit.cost)) {
    SetVerdict(
        Verdict::kRefused,
        "pictures and touched marks do not fit one machine: check the touches' places and tool "
        "lengths, and the stated place of the camera",
        result);
    return true;
  }
  auto contradiction = StatedContradiction(work.pieces, work.precision, options.false_alarm);
  if (!contradiction) {
    contradiction = PriorFault(work);
    if (contradiction) *contradiction += "; state it larger if the machine is so";
  }
  if (!contradiction) return false;
  SetVerdict(Verdict::kRefused, *contradiction, result);
  return true;
}

AdjustmentCheck CheckOf(const BoardMeasurement& measurement, const BoardWork& work) {
  const BoardNetwork& network = work.pieces.network;
  RejectionTally tally;
  for (std::size_t i = 0; i < network.observations.size(); ++i) {
    const NetworkObservation& observation = network.observations[i];
    const bool used = TakesPart(network, observation);
    if (!used && !work.rejected[i]) continue;
    tally.Add(
        {NameOf(measurement, observation.station), "mark " + work.pieces.ids[observation.point]},
        work.rejected[i]);
  }
  return tally.Check(static_cast<int>(std::lround(work.precision.pixel_redundancy)));
}

}  // namespace

Result<BoardCalibration> CalibrateByBoard(const BoardMeasurement& measurement,
                                          const BoardCalibrateOptions& options) {
  TRY(Validate(measurement, options));
  BoardCalibration result;
  NoteViews(measurement, result);
  if (const auto fault = SizeFault(measurement))
    return SetVerdict(Verdict::kRefused, *fault, result);
  BoardWork work;
  work.measurement = &measurement;
  work.pieces = PiecesOf(measurement);
  BoardNetwork& network = work.pieces.network;
  BoardStated stated = TakeStated(network);
  NoteUnused(network, result);
  if (NeedsMore(measurement, network, result)) return result;
  BoardStart start = StartBoard(network);
  if (RefuseStart(start, result)) return result;
  UseStart(start, network);
  work.rejected.assign(network.observations.size(), false);
  for (const std::size_t stray : start.strays) work.rejected[stray] = true;
  if (!start.strays.empty()) {
    result.notices.push_back(
        fmt::format("{} of {} marks in pictures left out: far beside where the others put them, as "
                    "misread or exchanged codes are",
                    start.strays.size(), network.observations.size()));
  }
  work.state = std::move(start.state);
  work.told = ToldOf(network);
  work.held = HeldOf(network, work.told);
  constexpr double kShallow = 0.1;
  work.depth_mm = start.depth_mm;
  work.shallow = start.depth_mm < kShallow * start.width_mm;
  const BoardWork fresh = work;
  Adjust(work, true);
  if (Misfits(work, options)) {
    // A few wrong rows or codes alone may cause that.
    BoardWork tried = fresh;
    BoardCalibration notes = result;
    if (!SettleLoosely(measurement, options, tried, notes) || Misfits(tried, options)) {
      NameMisfit(measurement, options.max_residual_sigma, work, result);
      return result;
    }
    work = std::move(tried);
    result = std::move(notes);
  }
  work.disc_radius_mm = DiscRadius(work);
  if (measurement.disc_radius_mm > 0) CorrectDiscs(work);
  FitSigmas(work);
  const bool few_wrong = LeaveOutWrong(measurement, options, work, result);
  if (few_wrong) FitSigmas(work);
  constexpr double kMaxRepeatability_mm = 0.06;  // table rounded to 0.2 mm
  if (!few_wrong || !work.fit.converged ||
      work.pixel_factor * PixelRoot(work) > options.max_residual_sigma ||
      work.pieces.network.machine.repeatability_mm > kMaxRepeatability_mm || PriorFault(work)) {
    NameMisfit(measurement, options.max_residual_sigma, work, result);
    return result;
  }
  if (RefuseStated(options, std::move(stated), work, result)) return result;
  result.print = PrintOf(work);
  if (RefuseUnits(work, result)) return result;
  result.covariance =
      work.precision.covariance.topLeftCorner<kCameraParameters, kCameraParameters>();
  result.check = CheckOf(measurement, work);
  if (!result.check.contradiction.empty()) {
    return SetVerdict(
        Verdict::kCannotTell,
        result.check.contradiction +
            "; see that no code is there twice, that board and marks lay still, and that "
            "the table belongs to the pictures",
        result);
  }
  if (RefuseChange(measurement, options, work, result.covariance, result)) return result;
  result.unchecked = UncheckedPlace(work.pieces.network, work.told);
  AnswerOf(work, options, result);
  return result;
}

}  // namespace trammel::part_alignment
