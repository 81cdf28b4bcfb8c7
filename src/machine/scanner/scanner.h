// Flatbed scanners, through SANE.
#pragma once

#include <functional>
#include <optional>
#include <stop_token>
#include <string>
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
  /// How long the scanner may say nothing, > 0: cold lamps take a minute.
  double silence_s = 120;
  /// How long its driver may take to put it to rest, > 0: until the carriage is back, with some.
  double rest_s = 20;
};

/// Errors (kMachine): SANE cannot be started; its drivers crash or hang.
[[nodiscard]] Result<std::vector<ScannerInfo>> ListScanners();

/// Scans one page. Its resolution is the one that the scanner says it took.
/// @param progress  is told the share of the page that is there, 0 … 1, now and then.
/// @returns errors (kMachine), with what to do: no scanner, or several and none named; busy,
/// jammed,
///          open cover, no permission, a connection that broke; a driver that crashed, or said
///          nothing for too long; (kInput) a resolution, area or option that the scanner has not,
///          naming those that it has; a page above the limit; (kInterrupted) stopped.
/// Drivers crash and hang, so they run in a process of their own (child_process.h).
[[nodiscard]] Result<Page> ScanPage(const ScanRequest& request, const PageReadOptions& limits,
                                    const std::function<void(double)>& progress,
                                    const std::stop_token& stop);

}  // namespace trammel::machine
