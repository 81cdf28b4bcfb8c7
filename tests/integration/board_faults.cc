#include "board_faults.h"

#include <Eigen/Core>
#include <cmath>
#include <numbers>
#include <utility>

namespace trammel::test {
namespace {

using part_alignment::BoardMeasurement;

std::size_t Somewhere(const sim::BoardSetup& setup, Random& random) {
  return setup.stops.size() / 5 + random.Below(setup.stops.size() * 3 / 5);
}

sim::Triple Sideways(double mm, Random& random) {
  const double turn = random.Uniform(0, 2 * std::numbers::pi);
  return {mm * std::cos(turn), mm * std::sin(turn), 0};
}

void EachPlace(BoardMeasurement& measurement, const std::function<void(Eigen::Vector3d&)>& change) {
  for (auto& view : measurement.views) change(view.spindle_mm);
  for (auto& touch : measurement.touches) change(touch.spindle_mm);
}

}  // namespace

void SetStops(sim::BoardSetup& setup, int count, double low_mm, double high_mm) {
  setup.stops.clear();
  const auto add = [&](int per_turn, double c_rad) {
    for (const auto& stop : sim::BoardStops(setup, per_turn, 5, 90, low_mm, high_mm, {c_rad})) {
      setup.stops.push_back(stop);
    }
  };
  add(count / 2, 0);
  add(count / 4, std::numbers::pi);
  add(count / 4, 0);
}

std::vector<BoardFault> BoardMishaps() {
  const auto board = [](double mm) {
    return [mm](sim::BoardSetup& setup, Random& random) {
      setup.mishap.board_moves_after = Somewhere(setup, random);
      setup.mishap.board_by_mm = Sideways(mm, random);
      setup.mishap.board_by_rad = mm / 100 * random.Uniform(-1, 1);
    };
  };
  const auto camera = [](double mm, double rad) {
    return [=](sim::BoardSetup& setup, Random& random) {
      setup.mishap.camera_moves_after = Somewhere(setup, random);
      setup.mishap.camera_by_mm = Sideways(mm, random);
      setup.mishap.camera_by_rad = Sideways(rad, random);
    };
  };
  const auto lens = [](double factor) {
    return [factor](sim::BoardSetup& setup, Random& random) {
      setup.mishap.lens_moves_after = Somewhere(setup, random);
      setup.mishap.focal_factor = factor;
    };
  };
  const auto others = [](double factor) {
    return [factor](sim::BoardSetup& setup, Random&) {
      setup.mishap.every_other = true;
      setup.mishap.focal_factor = factor;
    };
  };
  const auto warms = [](double mm) {
    return [mm](sim::BoardSetup& setup, Random&) { setup.machine.warms_by_mm = mm; };
  };
  const std::string moved = "the board moved|the camera was moved";
  return {{"board moves by 5 um", board(0.005), {}, moved, true},
          {"board moves by 20 um", board(0.02), {}, moved, true},
          {"board moves by 0.2 mm", board(0.2), {}, moved},
          {"board moves by 5 mm", board(5), {}, moved},
          {"camera touched: 20 um, 0.1 mrad", camera(0.02, 1e-4), {}, "the camera was moved"},
          {"camera touched: 0.5 mm, 2 mrad", camera(0.5, 2e-3), {}, "the camera was moved"},
          {"camera touched: 5 mm, 50 mrad", camera(5, 0.05), {}, "the camera was moved"},
          {"focus touched: f 0.02 % longer", lens(1.0002), {}, "the lens was touched"},
          {"focus touched: f 0.5 % longer", lens(1.005), {}, "the lens was touched"},
          {"focus touched: f 10 % longer", lens(1.1), {}, "the lens was touched"},
          {"two cameras in turn, f 0.1 % apart", others(1.001), {}, "two cameras"},
          {"two cameras in turn, f 2 % apart", others(1.02), {}, "two cameras"},
          {"two cameras in turn, f 30 % apart", others(1.3), {}, "two cameras|does not belong"},
          {"spindle grows by 10 um", warms(0.010), {}, "warm", true},
          {"spindle grows by 50 um", warms(0.050), {}, "warm"}};
}

std::vector<BoardFault> WrongBoardTables() {
  const auto places = [](std::function<void(Eigen::Vector3d&)> change) {
    return [change](BoardMeasurement& measurement, Random&) { EachPlace(measurement, change); };
  };
  const auto shifted = [](BoardMeasurement& measurement, Random&) {
    for (std::size_t i = measurement.views.size(); i-- > 1;) {
      measurement.views[i].spindle_mm = measurement.views[i - 1].spindle_mm;
      measurement.views[i].spindle_rotation = measurement.views[i - 1].spindle_rotation;
    }
  };
  const auto reversed = [](BoardMeasurement& measurement, Random&) {
    auto views = measurement.views;
    for (std::size_t i = 0; i < views.size(); ++i) {
      measurement.views[i].spindle_mm = views[views.size() - 1 - i].spindle_mm;
      measurement.views[i].spindle_rotation = views[views.size() - 1 - i].spindle_rotation;
    }
  };
  const auto shuffled = [](BoardMeasurement& measurement, Random& random) {
    for (std::size_t i = measurement.views.size(); i-- > 1;) {
      std::swap(measurement.views[i].spindle_mm, measurement.views[random.Below(i + 1)].spindle_mm);
    }
  };
  const auto one_wrong = [](double mm) {
    return [mm](BoardMeasurement& measurement, Random& random) {
      measurement.views[random.Below(measurement.views.size())].spindle_mm.x() += mm;
    };
  };
  const auto rounded = [](double mm) {
    return [mm](BoardMeasurement& measurement, Random&) {
      EachPlace(measurement,
                [mm](Eigen::Vector3d& at) { at = (at / mm).array().round().matrix() * mm; });
    };
  };
  const auto turned_back = [](BoardMeasurement& measurement, Random&) {
    for (auto& view : measurement.views) {
      view.spindle_rotation = view.spindle_rotation.transpose().eval();
    }
  };
  const auto quarter = [](sim::BoardSetup& setup, Random&) {
    for (auto& stop : setup.stops) stop.c_rad /= 2;
  };
  return {
      {"X of the wrong sign", {}, places([](auto& at) { at.x() = -at.x(); }), "mirror image"},
      {"Y of the wrong sign", {}, places([](auto& at) { at.y() = -at.y(); }), "mirror image"},
      {"Z of the wrong sign", {}, places([](auto& at) { at.z() = -at.z(); }), "mirror image"},
      {"X and Z of the wrong sign",
       {},
       places([](auto& at) { at.x() = -at.x(), at.z() = -at.z(); }),
       "look into the spindle"},
      {"X and Y exchanged",
       {},
       places([](auto& at) { std::swap(at.x(), at.y()); }),
       "mirror image"},
      {"C of the wrong sign (0, 90, 0)", quarter, turned_back, "do not fit"},
      {"all in inches", {}, places([](auto& at) { at /= 25.4; }), "the unit of the places"},
      {"X alone in inches", {}, places([](auto& at) { at.x() /= 25.4; }), "do not fit|no camera"},
      {"Z alone in inches", {}, places([](auto& at) { at.z() /= 25.4; }), "the unit of Z is wrong"},
      {"rows one place late", {}, shifted, "do not fit|no camera"},
      {"rows in the opposite order", {}, reversed, "do not fit|no camera"},
      {"rows shuffled", {}, shuffled, "does not belong"},
      {"one row 0.05 mm wrong", {}, one_wrong(0.05), "beside its place in the table", true},
      {"one row 1 mm wrong", {}, one_wrong(1), "beside its place in the table", true},
      {"one row 50 mm wrong", {}, one_wrong(50), "beside its place in the table", true},
      {"places rounded to 0.1 mm", {}, rounded(0.1), "beside where the machine states it", true}};
}

std::vector<BoardFault> OddBoardPictures() {
  const auto resized = [](BoardMeasurement& measurement, Random&) {
    for (auto& view : measurement.views) view.width_px = 2592, view.height_px = 1944;
    for (std::size_t i = 1; i < measurement.views.size(); i += 2) {
      measurement.views[i].width_px = 1296;
      measurement.views[i].height_px = 972;
    }
  };
  const auto empty = [](BoardMeasurement& measurement, Random& random) {
    for (int k = 0; k < 10; ++k) {
      measurement.views[random.Below(measurement.views.size())].observations.clear();
    }
  };
  const auto all_empty = [](BoardMeasurement& measurement, Random&) {
    for (auto& view : measurement.views) view.observations.clear();
    measurement.touches.clear();
  };
  const auto exchanged = [](BoardMeasurement& measurement, Random& random) {
    auto& seen = measurement.views[random.Below(measurement.views.size())].observations;
    std::swap(seen[0].target, seen[random.Below(seen.size() - 1) + 1].target);
  };
  const auto heights = [](double low_mm, double high_mm) {
    return [=](sim::BoardSetup& setup, Random&) { SetStops(setup, 100, low_mm, high_mm); };
  };
  const auto no_touch = [](BoardMeasurement& measurement, Random&) { measurement.touches.clear(); };
  const auto one_turn = [](sim::BoardSetup& setup, Random&) {
    for (auto& stop : setup.stops) stop.c_rad = 0;
  };
  const auto z_only = [](sim::BoardSetup& setup, Random&) {
    for (auto& stop : setup.stops) {
      stop.stated_mm[0] = setup.sheet.middle_mm[0];
      stop.stated_mm[1] = setup.sheet.middle_mm[1];
    }
  };
  const auto flat = [](sim::BoardSetup& setup, Random&) {
    for (auto& stop : setup.stops) stop.stated_mm[0] = setup.sheet.middle_mm[0];
  };
  const auto few = [](BoardMeasurement& measurement, Random&) { measurement.views.resize(6); };
  return {{"two picture sizes", {}, resized, "1296 x 972 px"},
          {"10 pictures without a mark", {}, empty, "no mark is in it", true},
          {"no picture with a mark", {}, all_empty, "at least 8 pictures"},
          {"two codes exchanged in a picture", {}, exchanged, "marks in pictures left out", true},
          {"6 pictures", {}, few, "at least 8 pictures"},
          {"one height", heights(300, 300), {}, "heights so much alike"},
          {"heights 299 … 301 mm", heights(299, 301), {}, "heights of 1 : 2", true},
          {"heights 270 … 275 mm", heights(270, 275), {}, "heights of 1 : 2", true},
          {"Z alone moves", z_only, no_touch, "moves along one line"},
          {"X stands still", flat, {}, "heights of 1 : 2|one plane", true},
          {"no touch", {}, no_touch, "place along the spindle's axis"},
          {"C 0 alone, touched in Z", one_turn, {}, "place across the spindle's axis"},
          {"C 0 alone, no touch", one_turn, no_touch, "place across the spindle's axis"}};
}

}  // namespace trammel::test
