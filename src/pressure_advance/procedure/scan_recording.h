// Files of a scan on disk: sweeps.json from the start, scan.json as soon as frames are placed.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/result.h"
#include "machine/camera/camera.h"
#include "pressure_advance/procedure/scan.h"
#include "pressure_advance/procedure/sweep_plan.h"
#include "pressure_advance/recording/scan.h"
#include "pressure_advance/response/transitions.h"
#include "pressure_advance/timing/sweep_timing.h"

namespace trammel::procedure {

/// Line as swept.
struct SweptLine {
  double pressure_advance_s = 0;
  AxisDirection print_direction = AxisDirection::kPlusX;
  SweptStretch stretch;  ///< stretch of the motion
  int pattern = 0;       ///< index on a plate of several
};

/// Recorded sweep of one line, or of several in one run.
struct RecordedSweep {
  std::vector<SweptLine> lines;  ///< at least one
  std::string video;             ///< in the recording's folder, with its `.times`
  std::vector<machine::CapturedFrame> frames;
  std::vector<pressure_advance::LineMove> motion;  ///< ways, on this machine's clock
  double clock_sigma_s = 0;                        ///< of the motion's times
};

/// Writes a recording that is readable at any moment (docs/reference/formats.md).
class ScanRecording {
 public:
  /// The request must outlive the recording.
  /// @param lines  number to be swept.
  ScanRecording(const ScanRequest& request, std::size_t lines);

  /// Writes sweeps.json, which lists the planned recordings. Errors: the disk's.
  [[nodiscard]] Result<void> Begin();

  /// Places the frames of all sweeps so far anew and writes both files. Decodes every frame of this
  /// sweep. Errors: the disk's; a picture that cannot be decoded.
  [[nodiscard]] Result<void> Add(RecordedSweep sweep);

  /// Reason why the last added sweep, or any sweep since, cannot be placed, or its line cannot be
  /// read; absent if all can.
  [[nodiscard]] const std::optional<std::string>& trouble() const { return trouble_; }

  /// Excludes the last sweep, because its line is swept again; its video remains. Errors: the
  /// disk's.
  [[nodiscard]] Result<void> SetLastAside();

  /// Errors (kMeasurement): at least a third of the lines have frames without position; with the
  /// reason.
  [[nodiscard]] Result<void> Finish() const;

  /// Returns a sentence for each line whose frames could not be placed, which scan.json omits, and
  /// for each with a gap that makes it unreadable.
  [[nodiscard]] const std::vector<std::string>& LeftOut() const { return left_out_; }
  /// Number of lines with a place, and of those in scan.json: fewer after an error.
  [[nodiscard]] std::size_t placed() const { return scan_.lines.size(); }
  [[nodiscard]] std::size_t safe() const { return safe_; }

 private:
  struct NotPlaced {
    std::string video;
    double pressure_advance_s = 0;
    std::string why;
    bool busy = false;  // a busy computer is the cause
  };
  struct Missing {
    std::size_t sweep = 0;
    std::size_t line = 0;  // index in the sweep
    std::string why;
  };
  struct Placed {
    pressure_advance::SessionTiming timing;
    std::vector<std::size_t> used;                              // the sweeps that it is of
    std::vector<std::pair<std::size_t, std::string>> left_out;  // the others, and why
  };
  [[nodiscard]] Result<void> Write();
  [[nodiscard]] Result<void> WriteSweeps() const;
  [[nodiscard]] Result<void> WriteScan();
  void PlaceAll();
  void FindCrop();
  void NameGap(std::size_t sweep, const pressure_advance::ScanLine& line);
  void NameMissing(const std::vector<Missing>& missing);
  [[nodiscard]] std::size_t recorded_lines() const;
  [[nodiscard]] Placed Place() const;
  [[nodiscard]] pressure_advance::SessionTiming Match(const std::vector<std::size_t>& sweeps) const;
  [[nodiscard]] std::string BusyComputer(const std::vector<std::size_t>& sweeps) const;

  const ScanRequest& request_;
  std::size_t lines_;
  const Result<pressure_advance::TransitionPlan> transitions_;  // common to all lines
  std::vector<RecordedSweep> recorded_;                         // without their frames
  std::vector<pressure_advance::SweepObservation> seen_;        // one for each
  bool our_clock_ = true;                   // capture times are on a clock of ours
  pressure_advance::SessionTiming timing_;  // of lines in scan_
  pressure_advance::Scan scan_;             // written to scan.json
  bool crop_sought_ = false;                // true if the settings have none
  std::optional<PixelRect> found_crop_;
  std::size_t safe_ = 0;  // lines that scan.json has
  std::vector<NotPlaced> not_placed_;
  std::vector<NotPlaced> set_aside_;
  std::optional<std::string> trouble_;
  std::vector<std::string> left_out_;
};

}  // namespace trammel::procedure
