// How hard a nozzle and a bed press on each other at a given depth.
#pragma once

#include <string_view>

namespace trammel::sim {

enum class ContactKind {
  kLinear,     ///< F = k d: everything that gives way is a spring
  kQuadratic,  ///< F = k d (1 + a d/D): stiffens (a > 0) or softens (a < 0)
  kCubic,      ///< F = k d (1 + a (d/D)^2)
  kPower,      ///< F = k D (d/D)^n: n = 1.5 is Hertz's sphere on a plane
  kTwoSlope,   ///< F = k d up to the knee, a times k more or less beyond: a second body bears too
  kYielding,   ///< F = k h D (1 - exp(-d/(h D))): gives way more and more, h is the knee
};

[[nodiscard]] std::string_view ToString(ContactKind kind);

/// How the stiffness grows behind the toe, at the end to that of the bed alone.
enum class ToeKind {
  kRounded,      ///< evenly with depth, or at once: a film that is pressed flat
  kExponential,  ///< a film in series whose compliance falls exponentially with force: it is packed
};

/// Force against the depth by which the carriage is below the height of first touch. What gives way
/// is all of it at once: bed, nozzle, cell and frame. Beyond D the law goes on along its tangent.
struct ContactLaw {
  ContactKind kind = ContactKind::kLinear;
  double stiffness_g_mm = 3500;  ///< k, 1 … 1e6
  double reference_mm = 0.045;   ///< D, 1e-4 … 1
  double share =
      0;  ///< a, -0.45 … 5 (kTwoSlope: -0.95 … 5): force at D in excess of k D, as a share of it
  double exponent = 1;  ///< n of kPower, 0.4 … 3
  double knee = 0.5;    ///< of kTwoSlope and kYielding, as a share of D, 0.05 … 20
  /// A soft film, burr or washer in front of all this: the stiffness is only toe_share of the law's
  /// at first. kRounded: it rises to it between toe_mm (1 - toe_rounding) and
  /// toe_mm (1 + toe_rounding). kExponential: d = x + (1 - s) T (1 - exp(-x / (s T))), with x the
  /// depth that the law sees, T toe_mm and s toe_share; far below, both are equally deep.
  ToeKind toe_kind = ToeKind::kRounded;
  double toe_mm = 0;                ///< 0 … 0.2
  double toe_share = 1;             ///< 0.02 … 1
  double toe_rounding = 0;          ///< 0 … 1
  double sheet_gap_mm = 0;          ///< a loose sheet gives way so far before it lies, 0 … 1
  double sheet_stiffness_g_mm = 0;  ///< and so softly, 0 … 1e5
};

/// gf; 0 at and above the height of first touch. Never falls with depth.
[[nodiscard]] double ContactForce(const ContactLaw& law, double depth_mm);

/// The inverse, to 1e-9 mm; 0 for forces that are not positive.
[[nodiscard]] double ContactDepth(const ContactLaw& law, double force_g);

}  // namespace trammel::sim
