#include "sim/spindle/spindle_files.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "base/check.h"

namespace trammel::sim {
namespace {

using Json = nlohmann::ordered_json;

// Returns a frame with this z; its x is as near to the part's x as possible, rotated about z.
Place FrameOf(const Triple& origin_mm, const SpindleTarget& target) {
  const Triple z = UnitOf(target.facing);
  const Triple near = std::abs(z[0]) < 0.9 ? Triple{1, 0, 0} : Triple{0, 1, 0};
  const Triple x = UnitOf(near - Dot(near, z) * z);
  const Turn columns = {x, Cross(z, x), z};
  return {origin_mm, Back(columns) * TurnZ(target.turn_rad)};
}

Json Stated(const SpindleWorld& world) {
  Json targets = Json::array();
  for (const SpindleTarget& target : world.setup.part.targets) {
    targets.push_back({{"id", target.id}, {"ideal_mm", target.ideal_mm}});
  }
  return {{"format", 1},
          {"camera", SpindleCameraJson(world.setup.stated_lens)},
          {"targets", targets},
          {"views", Json::array()}};
}

Json ViewJson(const SpindleWorld& world, std::size_t stop) {
  const SpindleStation& at = world.setup.stops[stop];
  return {{"spindle_mm", at.stated_mm},
          {"spindle_rotation", SpindleTurn(world.setup.machine, at.c_rad)}};
}

}  // namespace

nlohmann::ordered_json SpindleCameraJson(const SpindleLens& lens) {
  return {
      {"model", "brown_measured_to_ideal"},
      {"image_px", {lens.width_px, lens.height_px}},
      {"pixel_pitch_mm", lens.pixel_pitch_mm},
      {"focal_length_mm", lens.focal_length_mm},
      {"principal_point_offset_px", lens.principal_offset_px},
      {"k1", lens.k1},
      {"k2", lens.k2},
      {"p1", lens.p1},
      {"p2", lens.p2},
      {"taper_from_camera", {{"translation_mm", lens.offset_mm}, {"angles_rad", lens.angles_rad}}},
      {"looks_along", lens.along_plus_z ? "+z" : "-z"}};
}

SpindlePicture PictureAt(const SpindleWorld& world, std::size_t stop,
                         const std::vector<RingPattern>& patterns,
                         const std::vector<std::vector<HiddenWedge>>& hidden,
                         const SpindlePicture& like) {
  const std::vector<SpindleTarget>& targets = world.setup.part.targets;
  TRAMMEL_CHECK(
      patterns.size() == targets.size() && (hidden.empty() || hidden.size() == targets.size()),
      "{} targets, {} patterns, {} lists of wedges", targets.size(), patterns.size(),
      hidden.size());
  SpindlePicture picture = like;
  picture.lens = world.setup.lens;
  picture.targets.clear();
  const Place camera_from_part = Back(MachineFromCamera(world, stop)) * world.machine_from_part;
  for (std::size_t i = 0; i < targets.size(); ++i) {
    PlacedTarget placed;
    placed.camera_from_target = camera_from_part * FrameOf(world.targets_mm[i], targets[i]);
    placed.pattern = patterns[i];
    if (!hidden.empty()) placed.hidden = hidden[i];
    picture.targets.push_back(placed);
  }
  return picture;
}

std::string PictureName(std::size_t stop) { return fmt::format("view-{:02}.png", stop + 1); }

std::string ObservationsJson(const SpindleWorld& world, const SpindleName& name, double margin_px) {
  Json json = Stated(world);
  Random noise = ObservationNoiseOf(name);
  for (std::size_t stop = 0; stop < world.setup.stops.size(); ++stop) {
    Json view = ViewJson(world, stop);
    view["observations"] = Json::array();
    for (const SpindleObservation& seen : Look(world, stop, margin_px, noise)) {
      // Without noise a sigma of 0 would have an infinite weight.
      const double sigma_px = world.setup.sigma_px > 0 ? world.setup.sigma_px : 1e-3;
      view["observations"].push_back({{"target", world.setup.part.targets[seen.target].id},
                                      {"column_px", seen.noisy_px[0]},
                                      {"row_px", seen.noisy_px[1]},
                                      {"sigma_px", sigma_px}});
    }
    json["views"].push_back(view);
  }
  json["unknowns"] = {"pose", "clamp_angle"};
  return json.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

std::string ViewsJson(const SpindleWorld& world) {
  Json json = Stated(world);
  for (std::size_t stop = 0; stop < world.setup.stops.size(); ++stop) {
    Json view = ViewJson(world, stop);
    view["picture"] = PictureName(stop);
    json["views"].push_back(view);
  }
  json["unknowns"] = {"pose", "clamp_angle"};
  return json.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

std::string SpindleTruthJson(const SpindleWorld& world, const SpindleName& name, double margin_px) {
  Json targets = Json::array();
  for (std::size_t i = 0; i < world.targets_mm.size(); ++i) {
    targets.push_back({{"id", world.setup.part.targets[i].id},
                       {"part_mm", world.targets_mm[i]},
                       {"machine_mm", world.machine_from_part.Out(world.targets_mm[i])}});
  }
  Json views = Json::array();
  Random unused(0);
  for (std::size_t stop = 0; stop < world.setup.stops.size(); ++stop) {
    Json seen = Json::array();
    for (const SpindleObservation& observation : Look(world, stop, margin_px, unused)) {
      seen.push_back({{"target", world.setup.part.targets[observation.target].id},
                      {"column_px", observation.exact_px[0]},
                      {"row_px", observation.exact_px[1]}});
    }
    views.push_back({{"spindle_mm", world.actual_mm[stop]}, {"targets", seen}});
  }
  const Json json = {{"format", 1},
                     {"seed", name.seed},
                     {"clamping", name.clamping},
                     {"part_mm", world.machine_from_part.origin_mm},
                     {"part_angles_rad", world.part_angles_rad},
                     {"part_angles_mm_per_m", 1000.0 * world.part_angles_rad},
                     {"clamp_angle_rad", world.clamping.angle_rad},
                     {"clamp_eccentricity_mm", world.clamping.eccentricity_mm},
                     {"clamp_tilt_rad", world.clamping.tilt_rad},
                     {"temperature_c", world.setup.part.temperature_c},
                     {"camera", SpindleCameraJson(world.setup.lens)},
                     {"targets", targets},
                     {"views", views}};
  return json.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

}  // namespace trammel::sim
