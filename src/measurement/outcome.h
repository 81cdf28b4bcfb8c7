// What any instrument found, where it comes from, and what may be thought of it.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/measured.h"

namespace trammel::measurement {

enum class Instrument { kPressureAdvance, kTap, kToolOffset, kPartAlignment, kCameraSetup };

/// As files and folders spell it: "pressure_advance", "tap", "tool_offset", "part_alignment",
/// "camera_setup".
[[nodiscard]] std::string_view ToString(Instrument instrument);

/// The one that ToString spells so; nothing where there is none.
[[nodiscard]] std::optional<Instrument> InstrumentNamed(std::string_view name);

/// What ToString can say, in the order of the enumeration.
[[nodiscard]] std::span<const std::string_view> InstrumentNames();

/// As people read it: "pressure advance", "taps", "tool offsets", "part alignment", "camera and
/// laser".
[[nodiscard]] std::string_view WordsOf(Instrument instrument);

/// Where a result comes from.
struct Provenance {
  Instrument instrument = Instrument::kPressureAdvance;
  std::string program;               ///< with its version: "trammel 0.1.0"
  std::string utc;                   ///< ISO 8601 to the second, ending in Z
  std::vector<std::string> sources;  ///< recordings, photos, scans: paths as they were given
};

/// One quantity of an answer.
struct Answer {
  std::string name;  ///< as in JSON, [a-z0-9_]+: "pressure_advance", "tool_1_dx"
  std::string unit;  ///< of the value: "s", "mm", "rad"
  Measured value;
};

/// What was measured, and under which conditions. Empty: not known. change.h: SameSubject says
/// which of them results are compared under.
struct Subject {
  std::string printer = {};   ///< its address: two printers may share a name
  std::string nozzle = {};    ///< its diameter in mm: "0.40"
  std::string filament = {};  ///< as its user names it
  std::string toolhead = {};  ///< Klipper's name of its extruder: "extruder1"
  std::string spool = {};     ///< Spoolman's number of it: "17"
  std::string nozzle_c = {};  ///< degC, as it was set: "215"
  std::string bed_c = {};     ///< degC: "60"

  bool operator==(const Subject&) const = default;
};

/// One of a subject's texts.
struct SubjectText {
  std::string_view key;    ///< as JSON spells it: "nozzle_c"
  std::string_view words;  ///< as people read it: "nozzle temperature"
  std::string Subject::*text;
};

/// All of them, in the order in which they are told.
[[nodiscard]] std::span<const SubjectText> SubjectTexts();

struct Outcome {
  Provenance provenance;
  std::vector<Answer> answers;
  std::vector<std::string> notices;
  Subject subject = {};

  /// The worst of the answers'; refused where there is none.
  [[nodiscard]] Verdict verdict() const;
  /// Why the verdict is what it is, each reason once; empty when good.
  [[nodiscard]] std::string reason() const;
  /// The answer of that name, or nullptr.
  [[nodiscard]] const Answer* Find(std::string_view name) const;
};

}  // namespace trammel::measurement
