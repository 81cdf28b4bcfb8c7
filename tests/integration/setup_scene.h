// A virtual printer whose laser and camera sit otherwise than the settings say, and its truth.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "machine_shop.h"
#include "sim/camera/head_rig.h"

namespace trammel::test {

/// True mounting of laser and camera, in the terms of `trammel pa setup`.
struct SetupTruth {
  double offset_x_mm = 0;  ///< to the spot at the picture's nominal row
  double offset_y_mm = 0;
  double spot_column_px = 0;  ///< that spot in the whole picture
  double spot_row_px = 0;
  double focus_height_mm = 0;
  double px_per_mm = 0;    ///< at that height
  double distance_mm = 0;  ///< lens to plate, at that height
  double rotation_deg = 0;
  double laser_turn_deg = 0;
  double laser_sheet_deg = 0;
};

/// A shop whose camera sends whole pictures of 1280 x 720 px.
[[nodiscard]] ShopOptions SetupHall(std::uint64_t seed, const sim::MountedRig& rig,
                                    const sim::Condition& condition = {});

[[nodiscard]] SetupTruth TruthOf(std::uint64_t seed, const sim::MountedRig& rig,
                                 const sim::Condition& condition = {});

/// `trammel pa setup --printer … --clear-z 11,25 --out set` and more.
[[nodiscard]] std::vector<std::string> SetupArguments(const MachineShop& shop,
                                                      const std::vector<std::string>& more = {});

/// A value of setup.json against the truth.
struct SetupError {
  std::string name;
  double error = 0;
  double standard_uncertainty = 0;
  bool covered = false;  ///< true if in the 95 % interval
};

/// Offsets, focus, scale (relative), rotation and the laser's turn and angle. The offsets count
/// from where the command places the spot: the stripe has many places. The scale is that of the
/// height at which the command saw the mark.
[[nodiscard]] std::vector<SetupError> SetupErrors(const nlohmann::json& answer,
                                                  const SetupTruth& truth);

}  // namespace trammel::test
