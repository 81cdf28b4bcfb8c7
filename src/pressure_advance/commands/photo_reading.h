// Reading of a photo on this computer: its options, and the plan of the printed pattern.
#pragma once

#include <string>
#include <vector>

#include "base/result.h"
#include "pressure_advance/commands/analysis_run.h"
#include "pressure_advance/files/slicer_gcode.h"

namespace CLI {
class App;
}

namespace trammel::app {

/// Options as typed; empty: not given.
struct PhotoReading {
  std::string plan;
  std::string gcode;
  std::string plate;
  std::string pattern;
  std::string pa;
  std::string from;
  std::string start;
  std::string segments;
  bool photo = false;
};

void AddPhotoReadingOptions(CLI::App& command, PhotoReading& reading);

/// Returns the first option that is given; empty: none is.
[[nodiscard]] std::string FirstGiven(const PhotoReading& reading);

/// Does the same for the files to be written.
[[nodiscard]] std::string FirstOutput(const ReportFiles& files);

/// Analyses the photo by the options' plan, else by the plan that FindPlanOf finds, else by the
/// numbers printed beside the pattern.
/// @param print  content of --gcode; null without it
/// Errors: those of the options, of the plan and of AnalysePhoto.
[[nodiscard]] Result<AnalysisRun> ReadPhoto(const std::string& path, const PhotoReading& reading,
                                            const files::SlicerPrint* print);

/// Analysis of a recording or a photo on this computer.
struct LocalAnalysis {
  std::string path;
  std::vector<std::string> more;  ///< photos of further patterns, with --gcode
  PhotoReading photo;
  std::string flow_reference;  ///< recording of a known flow ratio; empty: none
  double reference_flow_ratio = 1;
  AnalysisOutput output;
};

/// Adds all options but the path and --json.
void AddLocalAnalysisOptions(CLI::App& command, LocalAnalysis& analysis);

/// Prints the answer, writes the files. Returns the exit code.
[[nodiscard]] Result<int> RunLocalAnalysis(const LocalAnalysis& analysis);

}  // namespace trammel::app
