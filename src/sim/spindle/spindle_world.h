// Virtual spindle: a machine that moves a clamped camera past the targets of a part.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "base/random.h"
#include "base/result.h"
#include "sim/spindle/spindle_lens.h"

namespace trammel::sim {

/// Actual position = stated position, sheared and scaled about the machine's zero, plus an error of
/// each approach. The defaults are a machine without errors.
struct SpindleMachine {
  bool along_y = false;  ///< the camera looks along +Y (a horizontal spindle), else along -Z
  Triple travel_low_mm = {0, 0, 0};
  Triple travel_high_mm = {3000, 2000, 1500};
  double repeatability_mm = 0;  ///< 1 sigma per axis, 0 … 1
  Triple scale = {};            ///< relative, per axis, +-0.01
  double square_xy_rad = 0;     ///< x gains square_xy * y; +-0.01
  double square_xz_rad = 0;     ///< x gains square_xz * z
  double square_yz_rad = 0;     ///< y gains square_yz * z
};

/// Variation from one clamping to the next. The defaults are the paper's coupling.
struct ClampingSpread {
  double angle_rad = 3.3e-3;       ///< uniform within +-this: half the backlash, 0 … 0.5
  double eccentricity_mm = 0.015;  ///< 1 sigma per axis, 0 … 5
  double tilt_rad = 0;             ///< 1 sigma per axis, 0 … 0.1
};

/// spindle = Rz(-angle) · Rx(tilt[0]) · Ry(tilt[1]) · taper + (eccentricity, 0): eq. 22.
struct SpindleClamping {
  double angle_rad = 0;
  std::array<double, 2> eccentricity_mm = {};
  std::array<double, 2> tilt_rad = {};
};

/// Target in the ideal part. `facing` is its normal, `turn_rad` its rotation about that.
struct SpindleTarget {
  int id = 0;
  Triple ideal_mm = {};
  Triple facing = {0, 0, 1};
  double turn_rad = 0;
};

struct SpindlePart {
  Triple origin_mm = {};        ///< nominal position in the machine
  Triple angles_rad = {};       ///< (alpha, beta, gamma) of eq. 2
  double misplaced_mm = 2;      ///< uniform within +-this per axis, by the seed
  double misplaced_rad = 2e-3;  ///< the same for the angles
  std::vector<SpindleTarget> targets;
  double temperature_c = 20;        ///< the ideal places hold at 20
  double expansion_per_k = 11e-6;   ///< about the part's origin
  double out_of_machine_mm = 0;     ///< error of each ideal coordinate, 1 sigma
  double out_of_machine_scale = 0;  ///< scale error of all: a wrong scale bar
};

/// Position of the spindle in the programme.
struct SpindleStation {
  Triple stated_mm = {};
  double c_rad = 0;  ///< orientation of the spindle about its axis
};

struct SpindleSetup {
  SpindleLens lens;         ///< the camera as it is
  SpindleLens stated_lens;  ///< as calibrated
  SpindleMachine machine;
  ClampingSpread spread;
  SpindlePart part;
  std::vector<SpindleStation> stops;
  double sigma_px = 0.03;  ///< noise of a centre per axis, 1 sigma, 0 … 10
};

/// Error (kInput): a stop outside the travel.
[[nodiscard]] Result<void> Validate(const SpindleSetup& setup);

/// Names a world: the seed defines part and machine, `clamping` one clamping and its pictures.
struct SpindleName {
  std::uint64_t seed = 0;
  std::uint64_t clamping = 0;
};

/// Truth drawn from a setup.
struct SpindleWorld {
  SpindleSetup setup;
  Place machine_from_part;
  Triple part_angles_rad = {};
  std::vector<Triple> targets_mm;  ///< part frame, actual positions, warm
  SpindleClamping clamping;
  std::vector<Triple> actual_mm;  ///< spindle position per stop
};

/// REQUIRES a valid setup.
[[nodiscard]] SpindleWorld DrawSpindleWorld(const SpindleSetup& setup, const SpindleName& name);

/// Returns the orientation of the spindle frame in the machine (R_cnc): z points from the tool to
/// the spindle.
[[nodiscard]] Turn SpindleTurn(const SpindleMachine& machine, double c_rad);

/// Applies eq. 21 with eccentricity and tilt: the camera's true position at a stop.
[[nodiscard]] Place MachineFromCamera(const SpindleWorld& world, std::size_t stop);

struct SpindleObservation {
  std::size_t target = 0;    ///< index into the part's targets
  PixelPlace exact_px = {};  ///< image of the target's centre
  PixelPlace noisy_px = {};  ///< with noise of sigma_px
};

/// Returns the targets that face the camera with centres in the picture, at least `margin_px` from
/// its edge. Draws two normal numbers for every target of the part, seen or not.
[[nodiscard]] std::vector<SpindleObservation> Look(const SpindleWorld& world, std::size_t stop,
                                                   double margin_px, Random& random);

/// Returns the random generator of the noise of a clamping's observations.
[[nodiscard]] Random ObservationNoiseOf(const SpindleName& name);
/// Returns the random generator of a clamping's pictures.
[[nodiscard]] Random PicturesOf(const SpindleName& name);

/// Lever of a camera's station for a target: the target's place less the spindle axis, in the
/// spindle's x and y.
using Lever = std::array<double, 2>;

/// Returns two stops per target, their levers 100 mm apart along x about a centre as jogged by a
/// person, within the field at 150 mm. With the clamp angle assumed 0, these levers cause the loss
/// of Table 2, to a factor of 1.3 in every column. Levers that are equal at all targets cause none
/// in alpha and beta, and levers symmetrical about the axis none at all.
[[nodiscard]] std::vector<std::array<Lever, 2>> JoggedLevers();

/// Returns the stops from which each target's nominal position is seen with these levers from
/// `distance_mm` (along the spindle, from the camera's origin), C at 0.
/// REQUIRES one pair of levers per target.
[[nodiscard]] std::vector<SpindleStation> StationsFor(
    const SpindleSetup& setup, double distance_mm, const std::vector<std::array<Lever, 2>>& levers);

/// Returns section 3.2's scene: four targets at the corners of 1.5 m x 1 m in the XY plane, viewed
/// along -Z. The part's origin is the centre of its targets.
[[nodiscard]] SpindleSetup LaboratoryScene(double distance_mm);

/// Returns section 4's scene: four targets at the corners of 10 m x 3 m in the XZ plane, viewed
/// along Y.
[[nodiscard]] SpindleSetup IndustryScene(double distance_mm);

}  // namespace trammel::sim
