// Flatbed scanners, through SANE's program scanimage.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/page.h"
#include "base/result.h"
#include "machine/page/page_file.h"

namespace trammel::machine {

struct ScannerInfo {
  std::string name;  ///< SANE's name, as for ScanRequest::device
  std::string vendor;
  std::string model;
  std::string kind;  ///< "flatbed scanner" and the like
};

/// Area from the glass's corner where x and y are 0.
struct ScanArea {
  double x_mm = 0;
  double y_mm = 0;
  double width_mm = 0;   ///< > 0
  double height_mm = 0;  ///< > 0
};

struct ScanRequest {
  std::string device;            ///< Empty: the only one that there is.
  double dpi = 600;              ///< [50, 9600]; one that the scanner has
  bool color = false;            ///< Tools of different colours need it.
  std::optional<ScanArea> area;  ///< Absent: all of the glass.
  std::vector<std::pair<std::string, std::string>> options;  ///< SANE's own, set last.
  std::string program = "/usr/bin/scanimage";
  /// Maximum time without output from scanimage, > 0: cold lamps take a minute.
  double silence_s = 120;
  /// Maximum time to end after the request, > 0: until the carriage is back, plus a margin.
  double rest_s = 20;
};

/// Errors (kMachine): scanimage is missing; its drivers crash or hang.
[[nodiscard]] Result<std::vector<ScannerInfo>> ListScanners(const ScanRequest& request = {});

/// Checks that a page can be scanned into a file of that name: .png, .tif or .tiff, and a new one.
[[nodiscard]] Result<void> CheckPagePath(const std::filesystem::path& path);

/// Scans one page into a new file, which is read back. REQUIRES CheckPagePath().
/// @param progress  receives the share of the page scanned, 0 … 1, now and then.
/// @returns the page, with the scanner's actual resolution. Errors (kMachine), with the remedy:
///          no scanimage; no scanner; busy, jammed, open cover, no permission, a connection that
///          broke; a driver that crashed, or printed nothing for too long; (kInput) several
///          scanners and none named; a resolution, area or option that the scanner lacks, with
///          those that it has; a page above the limit; (kInterrupted) stopped.
[[nodiscard]] Result<Page> ScanPage(const ScanRequest& request, const std::filesystem::path& to,
                                    const PageReadOptions& limits,
                                    const std::function<void(double)>& progress,
                                    const std::stop_token& stop);

struct ScannerOption {
  std::string name;                                ///< without dashes: "resolution", "x"
  bool active = true;                              ///< false: not as the other options are set
  std::vector<std::string> choices;                ///< allowed values; empty: any, or a range
  std::optional<std::pair<double, double>> range;  ///< least and most

  /// True if it accepts a number; any if it lists none.
  [[nodiscard]] bool Takes(double value) const;
  [[nodiscard]] bool Takes(std::string_view value) const;
  /// Returns the text for messages: "75, 150, 300" or "1 to 1200".
  [[nodiscard]] std::string Values() const;
};

class ScannerOptions {
 public:
  /// Parses one line of the list; skips a line that describes no option.
  void Add(std::string_view line);

  [[nodiscard]] const ScannerOption* Find(std::string_view name) const;
  /// Finds an option in the same way; null if it is not active.
  [[nodiscard]] const ScannerOption* FindActive(std::string_view name) const;

 private:
  std::vector<ScannerOption> options_;
};

}  // namespace trammel::machine
