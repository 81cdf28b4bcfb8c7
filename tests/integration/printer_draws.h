// Printers around and past the ends of what a pattern's settings assume: usual ones, what Moonraker
// answers about them, and the facts that a draw changes.
#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "base/random.h"
#include "klipper_model.h"

namespace trammel::test {

template <class T>
const T& OneOf(Random& random, const std::vector<T>& values) {
  return values[random.Below(values.size())];
}

[[nodiscard]] std::vector<ModelPrinter> UsualPrinters();

/// The objects that Moonraker answers about a printer.
[[nodiscard]] nlohmann::json ToldBy(const ModelPrinter& printer);

/// A printer, what it tells, and what a user sets.
struct Draw {
  ModelPrinter printer;
  /// Changes of its report: a place, and its new value; null erases it.
  std::vector<std::pair<nlohmann::json::json_pointer, nlohmann::json>> instead;
  std::vector<std::string> settings;  ///< key=value

  [[nodiscard]] ModelExtruder& extruder() { return printer.extruders.at(printer.active); }
  [[nodiscard]] nlohmann::json Told() const;
};

struct Fact {
  std::string name;
  /// Words of which a refusal must contain one.
  std::vector<std::string> words;
  /// Draws it anew. @returns what it is now
  std::function<std::string(Random&, Draw&)> change;
};

/// Every fact, each over all values that a printer may have and some that none has.
[[nodiscard]] std::vector<Fact> AllFacts();

/// True if one fact hides another: a fact that is not reported is unknown.
[[nodiscard]] bool Hides(const std::string& hiding, const std::string& hidden);

/// None, one or two settings as a user sets them: key=value.
[[nodiscard]] std::vector<std::string> DrawSettings(Random& random);

}  // namespace trammel::test
