// Flatbed scanners, through SANE's own program scanimage.
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
  std::string name;  ///< As SANE calls it; what ScanRequest::device takes.
  std::string vendor;
  std::string model;
  std::string kind;  ///< "flatbed scanner" and the like
};

/// From the glass's corner where x and y are 0.
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
  /// How long scanimage may print nothing, > 0: cold lamps take a minute.
  double silence_s = 120;
  /// How long it may take to end once it was asked, > 0: until the carriage is back, with some.
  double rest_s = 20;
};

/// Errors (kMachine): no scanimage; its drivers crash or hang.
[[nodiscard]] Result<std::vector<ScannerInfo>> ListScanners(const ScanRequest& request = {});

/// Whether a page can be scanned into a file of that name: .png, .tif or .tiff, and not there yet.
[[nodiscard]] Result<void> CheckPagePath(const std::filesystem::path& path);

/// Scans one page into a new file, which is read back. REQUIRES CheckPagePath().
/// @param progress  is given the share of the page that is there, 0 … 1, now and then.
/// @returns the page, with the resolution that the scanner took. Errors (kMachine), with what to
///          do: no scanimage; no scanner; busy, jammed, open cover, no permission, a connection
///          that broke; a driver that crashed, or printed nothing for too long; (kInput) several
///          scanners and none named; a resolution, area or option that the scanner has not, naming
///          those that it has; a page above the limit; (kInterrupted) stopped.
[[nodiscard]] Result<Page> ScanPage(const ScanRequest& request, const std::filesystem::path& to,
                                    const PageReadOptions& limits,
                                    const std::function<void(double)>& progress,
                                    const std::stop_token& stop);

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
