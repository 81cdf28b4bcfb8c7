#include "sim/survey/survey_pictures.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/random.h"

namespace trammel::sim {

using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

bool Faces(const Vector3d& at_mm, const Vector3d& normal, const Vector3d& eye_mm,
           double steepest_rad) {
  return (eye_mm - at_mm).normalized().dot(normal) > std::cos(steepest_rad);
}

Vector2d Noise(double sigma_px, Random& random) {
  const double column = sigma_px * random.Normal();
  return {column, sigma_px * random.Normal()};
}

/// Takes one picture.
class Photographer {
 public:
  Photographer(const SurveyPart& part, const HandLens& lens, const HandShot& shot,
               const SurveyPictureTraits& traits, const Random& random)
      : part_(part), lens_(lens), shot_(shot), traits_(traits), random_(random) {}

  SurveyShow Take(std::size_t picture) {
    AddMarks(picture);
    Merge();
    AddScrews();
    AddGlints();
    AddSpecks();
    for (std::size_t i = 0; i + 1 < show_.spots.size(); ++i) {
      std::swap(show_.spots[i], show_.spots[i + random_.Below(show_.spots.size() - i)]);
    }
    return show_;
  }

 private:
  void AddMarks(std::size_t picture) {
    for (std::size_t m = 0; m < part_.marks.size(); ++m) {
      const SurveyMark& mark = part_.marks[m];
      const Vector2d noise = Noise(traits_.sigma_px, random_);
      const Vector2d of_axes = Noise(traits_.sigma_px, random_);
      const bool missed = random_.Uniform() < traits_.missed;
      const bool unread = random_.Uniform() < traits_.code_unread;
      Vector3d at = mark.at_mm;
      if (traits_.move && traits_.move->mark == m && picture >= traits_.move->from_picture) {
        at += traits_.move->by_mm;
      }
      if (missed || !Faces(at, mark.normal, shot_.place_mm, traits_.steepest_rad)) continue;
      auto seen = DiscSeenAt(lens_, shot_, at, mark.normal, mark.radius_mm, traits_.margin_px);
      if (!seen || !IsOpenTo(part_.block, at, shot_.place_mm)) continue;
      seen->centre_px += noise;
      constexpr double kThinnest = 0.1;  // an outline has an inside
      seen->major_px = std::max(seen->minor_px, seen->major_px + of_axes.x());
      seen->minor_px =
          std::clamp(seen->minor_px + of_axes.y(), kThinnest * seen->major_px, seen->major_px);
      const bool read =
          !unread && Faces(at, mark.normal, shot_.place_mm, traits_.steepest_code_rad);
      show_.spots.push_back({*seen, read ? mark.code : 0, SpotKind::kMark, m});
    }
  }

  void Merge() {
    auto& spots = show_.spots;
    for (std::size_t i = 0; i < spots.size(); ++i) {
      for (std::size_t j = i + 1; j < spots.size(); ++j) {
        const double apart = (spots[i].seen.centre_px - spots[j].seen.centre_px).norm();
        if (apart > spots[i].seen.major_px + spots[j].seen.major_px + traits_.merged_px) continue;
        if (spots[i].code > 0 || spots[j].code > 0) continue;
        DiscImage& both = spots[i].seen;
        both.centre_px = 0.5 * (both.centre_px + spots[j].seen.centre_px);
        both.major_px += 0.5 * apart;
        spots[i].kind = SpotKind::kMerged;
        spots[i].mark = 0;
        spots.erase(spots.begin() + static_cast<std::ptrdiff_t>(j));
        --j;
      }
    }
  }

  void AddSpurious(const Vector2d& at_px, SpotKind kind) {
    DiscImage seen;
    seen.centre_px = at_px;
    seen.major_px = random_.Uniform(1, 3);
    seen.minor_px = seen.major_px * random_.Uniform(0.5, 1);
    seen.angle_rad = random_.Uniform(-0.5, 0.5) * std::numbers::pi;
    show_.spots.push_back({seen, 0, kind, 0});
    ++spurious_;
  }

  void AddScrews() {
    for (const SurveyScrew& screw : part_.screws) {
      const bool shines = random_.Uniform() < traits_.screw_seen;
      const Vector2d noise = Noise(traits_.glint_px, random_);
      const Vector3d top = screw.centre_mm + screw.radius_mm * screw.normal;
      if (!shines || !Faces(top, screw.normal, shot_.place_mm, traits_.steepest_rad) ||
          !IsOpenTo(part_.block, top, shot_.place_mm)) {
        continue;
      }
      const Vector3d& lamp = part_.lamps_mm[random_.Below(part_.lamps_mm.size())];
      const Vector3d glint = GlintOf(screw, lamp, shot_.place_mm);
      const auto seen = SeenAt(lens_, shot_, glint, traits_.margin_px);
      if (seen) AddSpurious(*seen + noise, SpotKind::kScrew);
    }
  }

  void AddGlints() {
    for (const Vector3d& lamp : part_.lamps_mm) {
      for (const Vector3d& glint : GlintsOf(part_.block, lamp, shot_.place_mm)) {
        const Vector2d noise = Noise(traits_.glint_px, random_);
        const auto seen = SeenAt(lens_, shot_, glint, traits_.margin_px);
        if (seen) AddSpurious(*seen + noise, SpotKind::kGlint);
      }
    }
  }

  // Adds specks up to the mean number, with random variation (uniform within a half of it).
  void AddSpecks() {
    const double wanted = traits_.spurious * random_.Uniform(0.5, 1.5);
    while (spurious_ < wanted) {
      const double column = random_.Uniform(traits_.margin_px, lens_.width_px - traits_.margin_px);
      const double row = random_.Uniform(traits_.margin_px, lens_.height_px - traits_.margin_px);
      AddSpurious({column, row}, SpotKind::kSpeck);
    }
  }

  const SurveyPart& part_;
  const HandLens& lens_;
  const HandShot& shot_;
  const SurveyPictureTraits& traits_;
  Random random_;
  SurveyShow show_;
  int spurious_ = 0;
};

}  // namespace

std::vector<SurveyShow> TakeSurveyPictures(const SurveyPart& part, const HandLens& lens,
                                           const std::vector<HandShot>& shots,
                                           const SurveyPictureTraits& traits, std::uint64_t seed) {
  const Random random = Random(seed).Fork(2);
  std::vector<SurveyShow> shows;
  for (std::size_t i = 0; i < shots.size(); ++i) {
    shows.push_back(Photographer(part, lens, shots[i], traits, random.Fork(i)).Take(i));
  }
  return shows;
}

std::vector<MarkSupport> SupportOf(const SurveyPart& part, const std::vector<HandShot>& shots,
                                   const std::vector<SurveyShow>& shows) {
  std::vector<std::vector<Vector3d>> observations(part.marks.size());
  for (std::size_t i = 0; i < shows.size(); ++i) {
    for (const SurveySpot& spot : shows[i].spots) {
      if (spot.kind != SpotKind::kMark) continue;
      observations[spot.mark].push_back(
          (shots[i].place_mm - part.marks[spot.mark].at_mm).normalized());
    }
  }
  std::vector<MarkSupport> supports;
  for (const auto& of_mark : observations) {
    MarkSupport& support = supports.emplace_back();
    support.pictures = static_cast<int>(of_mark.size());
    for (std::size_t i = 0; i < of_mark.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        const double angle = std::acos(std::clamp(of_mark[i].dot(of_mark[j]), -1.0, 1.0));
        support.widest_rad = std::max(support.widest_rad, angle);
      }
    }
  }
  return supports;
}

}  // namespace trammel::sim
