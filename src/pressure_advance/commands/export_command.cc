// trammel pa export
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>
#include <string>

#include "app/commands.h"
#include "app/output_files.h"
#include "files/whole_file.h"
#include "pressure_advance/commands/apply_command.h"
#include "pressure_advance/commands/pressure_advance_commands.h"
#include "pressure_advance/files/orca_profile.h"

namespace trammel::app {
namespace {

struct ExportArguments {
  std::string value;
  std::string orca;
  std::string out;
  bool force = false;
};

Result<int> RunExport(const ExportArguments& arguments) {
  constexpr std::size_t kMaxBytes = 4'000'000;
  TRY(RefuseToOverwrite({arguments.out}, arguments.force));
  const auto profile = TRY(files::ReadNamedFile(arguments.orca, kMaxBytes));
  const auto value = TRY(ValueFrom(arguments.value));
  const auto made = TRY(files::WithPressureAdvance(profile, arguments.orca, value.value_s));
  TRY(WriteOutputs({{arguments.out, made.text}}, arguments.force));
  for (const std::string& notice : made.notices) fmt::print("notice            {}\n", notice);
  fmt::print("pressure advance  {:.4f} s in {}: import it in OrcaSlicer\n", value.value_s,
             arguments.out);
  return kExitGood;
}

}  // namespace

void AddExportCommand(CLI::App& parent, int& exit_code) {
  CLI::App* command =
      parent.add_subcommand("export", "write a pressure advance into a slicer's filament profile");
  const auto arguments = std::make_shared<ExportArguments>();
  command->add_option("value", arguments->value, "seconds, a recording's folder or a kept result")
      ->required();
  command->add_option("--orca", arguments->orca, "a filament profile exported from OrcaSlicer")
      ->required();
  command->add_option("-o,--out", arguments->out, "the profile to import there")->required();
  command->add_flag("--force", arguments->force, "overwrite it");
  command->callback([arguments, &exit_code] { exit_code = CodeOf(RunExport(*arguments)); });
}

}  // namespace trammel::app
