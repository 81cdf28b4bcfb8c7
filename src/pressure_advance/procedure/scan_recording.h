// What a scan leaves on disk: sweeps.json from the start, scan.json as soon as frames are placed.
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

/// A line as it was swept.
struct SweptLine {
  double pressure_advance_s = 0;
  AxisDirection print_direction = AxisDirection::kPlusX;
  SweptStretch stretch;  ///< of the motion
  int pattern = 0;       ///< of several on one plate
};

/// One sweep, of one line or of several in one go, as it was recorded.
struct RecordedSweep {
  std::vector<SweptLine> lines;  ///< at least one
  std::string video;             ///< in the recording's folder; its `.times` beside it
  std::vector<machine::CapturedFrame> frames;
  std::vector<pressure_advance::LineMove> motion;  ///< ways, on this machine's clock
  double clock_sigma_s = 0;                        ///< of the motion's times
};

/// Keeps a recording readable at any moment (docs/reference/formats.md).
class ScanRecording {
 public:
  /// The request outlives the recording.
  /// @param lines  that are to be swept.
  ScanRecording(const ScanRequest& request, std::size_t lines);

  /// Writes sweeps.json, which says what is going to be recorded. Errors: the disk's.
  [[nodiscard]] Result<void> Begin();

  /// Places the frames of all sweeps so far anew and writes both files. Decodes every frame of this
  /// sweep. Errors: the disk's; a picture that cannot be decoded.
  [[nodiscard]] Result<void> Add(RecordedSweep sweep);

  /// Why the sweep that was added last cannot be placed, or nothing can since it was, or why its
  /// line cannot be read; absent where all can.
  [[nodiscard]] const std::optional<std::string>& trouble() const { return trouble_; }

  /// Leaves the sweep that was added last to itself, because its line is swept again; its video
  /// stays. Errors: the disk's.
  [[nodiscard]] Result<void> SetLastAside();

  /// Errors (kMeasurement): the frames of a third of the lines or more could not be placed; with
  /// the reason.
  [[nodiscard]] Result<void> Finish() const;

  /// A sentence for each line whose frames could not be placed, which scan.json is without, and for
  /// each with a gap that keeps it from being read.
  [[nodiscard]] const std::vector<std::string>& LeftOut() const { return left_out_; }
  /// How many lines have their place, and how many of them scan.json has: fewer after an error.
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
    std::size_t line = 0;  // of the sweep
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
  const Result<pressure_advance::TransitionPlan> transitions_;  // of every line
  std::vector<RecordedSweep> recorded_;                         // without their frames
  std::vector<pressure_advance::SweepObservation> seen_;        // one for each
  bool our_clock_ = true;                   // capture times are on a clock of ours
  pressure_advance::SessionTiming timing_;  // of the lines in scan_
  pressure_advance::Scan scan_;             // for scan.json
  bool crop_sought_ = false;                // where the settings name none
  std::optional<PixelRect> found_crop_;
  std::size_t safe_ = 0;  // lines that scan.json has
  std::vector<NotPlaced> not_placed_;
  std::vector<NotPlaced> set_aside_;
  std::optional<std::string> trouble_;
  std::vector<std::string> left_out_;
};

}  // namespace trammel::procedure
