// The questions of align init, what its answers mean, and the files and commands made of them.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "part_alignment/commands/linuxcnc_options.h"
#include "part_alignment/procedure/start_dialogue.h"
#include "part_alignment/views/machine_box.h"

namespace trammel::app {

/// What is asked before the machine is looked at.
[[nodiscard]] std::vector<procedure::StartQuestion> MachineQuestions();

/// What is asked after it; where the controller tells something, that is the fallback.
[[nodiscard]] std::vector<procedure::StartQuestion> JobQuestions(
    const std::optional<machine::LinuxCncFacts>& facts, const procedure::StartAnswers& answers);

struct StartValues {
  std::string machine;  ///< "session", "session:" and a helper's words, "none"
  std::string camera;   ///< files
  std::string targets;
  std::string source;  ///< of pictures
  bool c_holds_spindle = false;
  int joints = 3;
  Eigen::Vector3d rough_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d rough_rad = Eigen::Vector3d::Zero();
  part_alignment::MachineBox travel;
  std::vector<part_alignment::MachineBox> obstacles;
  double safe_z_mm = 0;
  double distance_mm = 0;
  std::string work_offset;
  int bits = 14;
  std::string id_prefix;            ///< of the targets
  procedure::StartAnswers answers;  ///< as they were given, for the commands
};

/// REQUIRES answers to all questions.
[[nodiscard]] StartValues ValuesOf(const procedure::StartAnswers& answers,
                                   const std::optional<machine::LinuxCncFacts>& facts, int joints);

struct StartFiles {
  explicit StartFiles(const std::filesystem::path& in);

  std::filesystem::path folder;
  std::filesystem::path settings;  ///< observations without views, which align plan reads
  std::filesystem::path views;     ///< the same with views, for align measure
};

/// Observations without views (docs/formats.md); the files of camera and targets by their paths
/// from the folder.
[[nodiscard]] std::string SettingsText(const StartFiles& names, const StartValues& values);

/// The five commands from the clamped camera to the work offset, each with a remark.
[[nodiscard]] std::string CommandsText(const StartFiles& names, const StartValues& values);

}  // namespace trammel::app
