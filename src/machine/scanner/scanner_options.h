// The options of a scanner, as `scanimage -A` lists them.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace trammel::machine {

struct ScannerOption {
  std::string name;                                ///< without its dashes: "resolution", "x"
  bool active = true;                              ///< false: not as the other options are set
  std::vector<std::string> choices;                ///< that it may have; empty: any, or a range
  std::optional<std::pair<double, double>> range;  ///< least and most

  /// Whether it takes a number; any where it states nothing.
  [[nodiscard]] bool Takes(double value) const;
  [[nodiscard]] bool Takes(std::string_view value) const;
  /// For messages: "75, 150, 300" or "1 to 1200".
  [[nodiscard]] std::string Values() const;
};

class ScannerOptions {
 public:
  /// Reads one line of the list; one that describes no option is passed over.
  void Add(std::string_view line);

  [[nodiscard]] const ScannerOption* Find(std::string_view name) const;
  /// Likewise, null where it is not active.
  [[nodiscard]] const ScannerOption* FindActive(std::string_view name) const;

 private:
  std::vector<ScannerOption> options_;
};

}  // namespace trammel::machine
