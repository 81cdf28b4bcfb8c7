#include "plain_scene.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <string>

#include "base/random.h"

namespace trammel {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using part_alignment::Survey;
using part_alignment::SurveyedTarget;

constexpr double kMinAngle_rad = 15 * std::numbers::pi / 180;
constexpr int kMinPictures = 4;
constexpr double kMaxSigmas = 5;

struct Motion {
  Matrix3d rotation = Matrix3d::Identity();
  Vector3d translation = Vector3d::Zero();
};

/// A target given, and the mark it is; `mark` absent where it is none.
struct Match {
  std::size_t given = 0;
  std::optional<std::size_t> mark;
};

// Truth into the survey's frame.
Motion Lay(const PlainWorld& world, const Survey& survey, const std::vector<Match>& matches) {
  std::vector<const Match*> known;
  for (const Match& match : matches) {
    if (match.mark) known.push_back(&match);
  }
  Eigen::Matrix3Xd truth(3, known.size());
  Eigen::Matrix3Xd found(3, known.size());
  for (std::size_t i = 0; i < known.size(); ++i) {
    truth.col(static_cast<Eigen::Index>(i)) = world.part.marks[*known[i]->mark].at_mm;
    found.col(static_cast<Eigen::Index>(i)) = survey.targets[known[i]->given].at_mm;
  }
  const Eigen::Matrix4d motion = Eigen::umeyama(truth, found, false);
  return {motion.topLeftCorner<3, 3>(), motion.topRightCorner<3, 1>()};
}

Matrix3d CovarianceOf(const Survey& survey, std::size_t given) {
  const auto at = static_cast<Eigen::Index>(3 * given);
  return survey.covariance.block<3, 3>(at, at);
}

// Along the axes of its own ellipsoid.
double SigmasOff(const Matrix3d& covariance, const Vector3d& off) {
  const Eigen::SelfAdjointEigenSolver<Matrix3d> axes(covariance);
  const Vector3d along = axes.eigenvectors().transpose() * off;
  return along.cwiseAbs().cwiseQuotient(axes.eigenvalues().cwiseMax(1e-18).cwiseSqrt()).maxCoeff();
}

std::vector<Match> CodedMatches(const PlainWorld& world, const Survey& survey) {
  std::vector<Match> matches;
  for (std::size_t i = 0; i < survey.targets.size(); ++i) {
    if (survey.targets[i].plain) continue;
    for (std::size_t m = 0; m < world.part.marks.size(); ++m) {
      const int code = world.part.marks[m].code;
      if (code > 0 && survey.targets[i].id == std::to_string(code)) matches.push_back({i, m});
    }
  }
  return matches;
}

/// Nearest of all places where a mark ever stood.
struct Nearest {
  std::size_t mark = 0;
  Vector3d off = Vector3d::Constant(std::numeric_limits<double>::infinity());
};
Nearest NearestTo(const PlainWorld& world, const Motion& motion, const Vector3d& at_mm) {
  Nearest nearest;
  const auto& move = world.scene.pictures.move;
  for (std::size_t m = 0; m < world.part.marks.size(); ++m) {
    const auto look_at = [&](const Vector3d& place_mm) {
      const Vector3d off = at_mm - motion.rotation * place_mm - motion.translation;
      if (off.norm() < nearest.off.norm()) nearest = {m, off};
    };
    look_at(world.part.marks[m].at_mm);
    if (move && move->mark == m) look_at(world.part.marks[m].at_mm + move->by_mm);
  }
  return nearest;
}

// Squared error of some targets by their covariance, without the six motions of the whole.
double Nees(const PlainWorld& world, const Survey& survey, const std::vector<Match>& matches) {
  const auto n = static_cast<Eigen::Index>(3 * matches.size());
  const Motion motion = Lay(world, survey, matches);
  Eigen::VectorXd off(n);
  Eigen::MatrixXd covariance(n, n);
  Eigen::MatrixXd motions(n, 6);
  for (Eigen::Index i = 0; i < n / 3; ++i) {
    const Match& match = matches[static_cast<std::size_t>(i)];
    const Vector3d there =
        motion.rotation * world.part.marks[*match.mark].at_mm + motion.translation;
    off.segment<3>(3 * i) = survey.targets[match.given].at_mm - there;
    motions.block<3, 3>(3 * i, 0).setIdentity();
    constexpr double kSize_mm = 1000;
    for (int axis = 0; axis < 3; ++axis) {
      motions.block<3, 1>(3 * i, 3 + axis) = Vector3d::Unit(axis).cross(there) / kSize_mm;
    }
    for (Eigen::Index j = 0; j < n / 3; ++j) {
      const auto other = static_cast<Eigen::Index>(matches[static_cast<std::size_t>(j)].given);
      covariance.block<3, 3>(3 * i, 3 * j) =
          survey.covariance.block<3, 3>(3 * static_cast<Eigen::Index>(match.given), 3 * other);
    }
  }
  const Eigen::MatrixXd free = Eigen::HouseholderQR<Eigen::MatrixXd>(motions).householderQ() *
                               Eigen::MatrixXd::Identity(n, 6);
  const auto project = [&](const Eigen::MatrixXd& of) -> Eigen::MatrixXd {
    return of - free * (free.transpose() * of);
  };
  off = project(off);
  const double size = covariance.trace() / static_cast<double>(n);
  covariance = project(project(covariance).transpose()) + size * free * free.transpose();
  return off.dot(covariance.ldlt().solve(off));
}

bool IsWithinPair(const PlainWorld& world, const Vector3d& at_mm) {
  constexpr double kNear_mm = 6;
  int near = 0;
  for (const sim::SurveyMark& mark : world.part.marks) {
    near += (mark.at_mm - at_mm).norm() < kNear_mm ? 1 : 0;
  }
  return near >= 2;
}

bool IsOfPair(const PlainWorld& world, std::size_t mark) {
  constexpr double kNear_mm = 10;
  const Vector3d& at = world.part.marks[mark].at_mm;
  const auto& marks = world.part.marks;
  return std::any_of(marks.begin(), marks.end(), [&](const sim::SurveyMark& other) {
    return &other != &marks[mark] && (other.at_mm - at).norm() < kNear_mm;
  });
}

bool IsOnScrew(const PlainWorld& world, const Vector3d& at_mm) {
  constexpr double kNear_mm = 8;
  const auto& screws = world.part.screws;
  return std::any_of(screws.begin(), screws.end(), [&](const sim::SurveyScrew& screw) {
    return (screw.centre_mm - at_mm).norm() < kNear_mm;
  });
}

}  // namespace

PlainWorld DrawPlainWorld(const PlainScene& scene, std::uint64_t seed) {
  PlainWorld world{scene, {}, sim::WalkAround(scene.walk, seed), {}};
  world.part = sim::DrawSurveyPart(scene.part, world.shots, seed);
  if (scene.moved_mm > 0) {
    Random random = Random(seed).Fork(3);
    sim::MarkMove move;
    const auto coded = static_cast<std::size_t>(scene.part.coded) + 4;  // and the bars'
    move.mark = coded + random.Below(world.part.marks.size() - coded);
    move.from_picture = world.shots.size() / 2;
    move.by_mm = scene.moved_mm * world.part.marks[move.mark].normal.unitOrthogonal();
    world.scene.pictures.move = move;
  }
  world.shows =
      sim::TakeSurveyPictures(world.part, scene.lens, world.shots, world.scene.pictures, seed);
  return world;
}

part_alignment::SurveyInput PlainInput(const PlainWorld& world) {
  const PlainScene& scene = world.scene;
  part_alignment::SurveyInput input;
  for (const sim::SurveyBar& bar : world.part.bars) {
    input.bars.push_back(
        {std::to_string(bar.from), std::to_string(bar.to), bar.length_mm, bar.sigma_mm});
  }
  const double sigma_px = scene.stated_of_true * scene.pictures.sigma_px;
  for (std::size_t i = 0; i < world.shows.size(); ++i) {
    auto& picture = input.pictures.emplace_back();
    picture.name = "picture-" + std::to_string(i + 1);
    picture.width_px = scene.lens.width_px;
    picture.height_px = scene.lens.height_px;
    for (const sim::SurveySpot& spot : world.shows[i].spots) {
      const Eigen::Vector2d& at = spot.seen.centre_px;
      const part_alignment::ImageEllipse disc{at.x(), at.y(), spot.seen.major_px,
                                              spot.seen.minor_px, spot.seen.angle_rad};
      if (spot.code > 0) {
        picture.observations.push_back({std::to_string(spot.code), at.x(), at.y(), sigma_px});
        if (scene.discs) picture.discs.push_back(disc);
        continue;
      }
      picture.plain.push_back({at.x(), at.y(), sigma_px, std::nullopt});
      if (scene.discs) picture.plain.back().disc = disc;
    }
  }
  return input;
}

PlainCounts CountPlain(const PlainWorld& world, const Survey& survey) {
  const auto coded = CodedMatches(world, survey);
  PlainCounts counts;
  std::vector<bool> taken(world.part.marks.size());
  for (const Match& match : coded) taken[*match.mark] = true;
  const auto& move = world.scene.pictures.move;
  const auto supports = sim::SupportOf(world.part, world.shots, world.shows);
  const auto is_shown = [&](std::size_t mark) {
    return world.part.marks[mark].code == 0 && !(move && move->mark == mark) &&
           supports[mark].pictures >= kMinPictures && supports[mark].widest_rad >= kMinAngle_rad;
  };
  for (std::size_t m = 0; m < world.part.marks.size(); ++m) {
    if (!is_shown(m)) continue;
    ++counts.shown;
    if (IsOfPair(world, m)) ++counts.pairs_shown;
  }

  // Near enough for the frame, whatever is stated.
  constexpr double kSame_mm = 1;
  Motion motion = Lay(world, survey, coded);
  std::vector<Match> all = coded;
  for (std::size_t i = 0; i < survey.targets.size(); ++i) {
    const Nearest nearest = NearestTo(world, motion, survey.targets[i].at_mm);
    const bool moved = move && move->mark == nearest.mark;
    if (survey.targets[i].plain && nearest.off.norm() < kSame_mm && !moved) {
      all.push_back({i, nearest.mark});
    }
  }
  motion = Lay(world, survey, all);

  std::vector<Match> found;
  for (std::size_t i = 0; i < survey.targets.size(); ++i) {
    const SurveyedTarget& target = survey.targets[i];
    if (!target.plain) continue;
    ++counts.given;
    const Nearest nearest = NearestTo(world, motion, target.at_mm);
    if (SigmasOff(CovarianceOf(survey, i), nearest.off) > kMaxSigmas) {
      ++counts.astray;
      const Vector3d at = motion.rotation.transpose() * (target.at_mm - motion.translation);
      if (IsWithinPair(world, at)) ++counts.between;
      if (IsOnScrew(world, at)) ++counts.on_screws;
      continue;
    }
    if (move && move->mark == nearest.mark) {
      ++counts.moved_given;
      continue;
    }
    if (taken[nearest.mark]) {
      ++counts.twice;
      if (world.part.marks[nearest.mark].code > 0) ++counts.coded_again;
      continue;
    }
    taken[nearest.mark] = true;
    found.push_back({i, nearest.mark});
    (is_shown(nearest.mark) ? counts.found : counts.beyond) += 1;
    if (is_shown(nearest.mark) && IsOfPair(world, nearest.mark)) ++counts.pairs_found;
    counts.squares_mm2 += nearest.off.squaredNorm();
    counts.stated_mm2 += CovarianceOf(survey, i).trace();
    counts.worst_mm = std::max(counts.worst_mm, nearest.off.cwiseAbs().maxCoeff());
    counts.coordinates += 3;
  }
  if (found.size() > 2) {
    counts.nees = Nees(world, survey, found);
    counts.freedom = static_cast<int>(3 * found.size()) - 6;
  }
  if (coded.size() > 2) {
    counts.coded_nees = Nees(world, survey, coded);
    counts.coded_freedom = static_cast<int>(3 * coded.size()) - 6;
  }
  return counts;
}

}  // namespace trammel
