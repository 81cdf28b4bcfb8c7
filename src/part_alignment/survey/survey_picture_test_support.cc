#include "part_alignment/survey/survey_picture_test_support.h"

#include <Eigen/Geometry>
#include <cmath>
#include <vector>

#include "support/target_picture.h"

namespace trammel::part_alignment::test {

Page PictureOf(const SurveyWorld& world, const WorldShot& shot, const CodeBook& book,
               Random& random) {
  constexpr double kRadius_mm = 13;
  const SurveyScene& scene = world.scene;
  std::vector<trammel::test::DrawnTarget> drawn;
  for (const auto& [id, target] : world.targets) {
    const Eigen::Vector3d ray = target.at_mm - shot.place_mm;
    if (-ray.normalized().dot(target.normal) < std::cos(scene.steepest_incidence_rad)) continue;
    const auto from_world = [&](const Eigen::Vector3d& v) {
      return Eigen::Vector3d(v.dot(shot.right), v.dot(shot.down), v.dot(shot.ahead));
    };
    const Eigen::Vector3d along = target.normal.unitOrthogonal();
    Eigen::Matrix3d h;
    h << kRadius_mm * from_world(along), kRadius_mm * from_world(along.cross(target.normal)),
        from_world(ray);
    Eigen::Matrix3d camera;
    camera << shot.focal_px, 0, 0.5 * (scene.width_px - 1), 0, shot.focal_px,
        0.5 * (scene.height_px - 1), 0, 0, 1;
    h = camera * h;
    const Eigen::Vector2d centre = h.col(2).hnormalized();
    constexpr double kMargin_px = 40;
    if (h(2, 2) < 100 || centre.x() < kMargin_px || centre.y() < kMargin_px ||
        centre.x() > scene.width_px - kMargin_px || centre.y() > scene.height_px - kMargin_px) {
      continue;
    }
    trammel::test::DrawnTarget one;
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) one.h[r][c] = h(r, c) / h(2, 2);
    }
    one.bits = book.bits;
    one.word = book.words.at(std::stoul(id) - 1);
    drawn.push_back(one);
  }
  return trammel::test::Expose(trammel::test::Draw(scene.width_px, scene.height_px, drawn, {}), 1.0,
                               random);
}

void NumberBarEnds(SurveyWorld& world, int first) {
  for (auto& bar : world.bars) {
    for (std::string* end : {&bar.from, &bar.to}) {
      const std::string number = std::to_string(first++);
      world.targets[number] = world.targets.at(*end);
      world.targets.erase(*end);
      *end = number;
    }
  }
}

}  // namespace trammel::part_alignment::test
