// Outcome of any instrument: its answers, their origin and their reliability.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/measured.h"

namespace trammel::measurement {

enum class Instrument { kPressureAdvance, kTap, kToolOffset, kPartAlignment, kCameraSetup };

/// Returns the spelling in files and folders: "pressure_advance", "tap", "tool_offset",
/// "part_alignment", "camera_setup".
[[nodiscard]] std::string_view ToString(Instrument instrument);

/// Returns the instrument with that ToString name; absent if there is none.
[[nodiscard]] std::optional<Instrument> InstrumentNamed(std::string_view name);

/// Returns all names of ToString, in the order of the enumeration.
[[nodiscard]] std::span<const std::string_view> InstrumentNames();

/// Returns the name for users: "pressure advance", "taps", "tool offsets", "part alignment",
/// "camera and laser".
[[nodiscard]] std::string_view WordsOf(Instrument instrument);

/// Origin of a result.
struct Provenance {
  Instrument instrument = Instrument::kPressureAdvance;
  std::string program;               ///< name and version: "trammel 0.1.0"
  std::string utc;                   ///< ISO 8601 to the second, ending in Z
  std::vector<std::string> sources;  ///< recordings, photos, scans: paths as they were given
};

/// Quantity of an answer.
struct Answer {
  std::string name;  ///< as in JSON, [a-z0-9_]+: "pressure_advance", "tool_1_dx"
  std::string unit;  ///< of the value: "s", "mm", "rad"
  Measured value;
};

/// Measured object and conditions. Empty: unknown. SameSubject in change.h defines the conditions
/// under which results are compared.
struct Subject {
  std::string printer = {};   ///< address, as names may not be unique
  std::string nozzle = {};    ///< diameter in mm: "0.40"
  std::string filament = {};  ///< user's name for it
  std::string toolhead = {};  ///< Klipper's name of its extruder: "extruder1"
  std::string spool = {};     ///< Spoolman's number of it: "17"
  std::string nozzle_c = {};  ///< degC, as it was set: "215"
  std::string bed_c = {};     ///< degC: "60"

  bool operator==(const Subject&) const = default;
};

/// Text of a subject.
struct SubjectText {
  std::string_view key;    ///< JSON key: "nozzle_c"
  std::string_view words;  ///< displayed text: "nozzle temperature"
  std::string Subject::*text;
};

/// Returns all texts of a subject, in display order.
[[nodiscard]] std::span<const SubjectText> SubjectTexts();

struct Outcome {
  Provenance provenance;
  std::vector<Answer> answers;
  std::vector<std::string> notices;
  Subject subject = {};

  /// Returns the worst verdict of the answers; refused if there is none.
  [[nodiscard]] Verdict verdict() const;
  /// Returns the reasons for the verdict, each once; empty when good.
  [[nodiscard]] std::string reason() const;
  /// Finds the answer of that name, or nullptr.
  [[nodiscard]] const Answer* Find(std::string_view name) const;
};

}  // namespace trammel::measurement
