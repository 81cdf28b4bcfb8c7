// trammel config: what can be set, and whether a file sets it rightly.
#include "app/config_command.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <string>

#include "app/commands.h"
#include "app/config/config_file.h"
#include "files/whole_file.h"

namespace trammel::app {
namespace {

Result<void> Check(const std::string& file) {
  const Result<std::string> text = files::ReadWholeFile(file, files::kMaxConfigBytes);
  if (!text) return tl::unexpected(text.error());
  const Result<files::Config> config = files::ParseConfig(*text, file);
  if (!config) return tl::unexpected(config.error());
  if (auto valid = files::ValidateConfig(*config, *text, file); !valid) return valid;
  fmt::print("{}: good, {} key(s) set\n", file, config->keys.size());
  return {};
}

}  // namespace

void AddConfigCommands(CLI::App& config, int& exit_code) {
  config.require_subcommand(1);

  CLI::App* check =
      config.add_subcommand("check", "say whether a file can be used, or what is wrong");
  auto file = std::make_shared<std::string>("trammel.toml");
  check->add_option("FILE", *file, "settings")->capture_default_str();
  check->callback([file, &exit_code] {
    const Result<void> done = Check(*file);
    if (!done) exit_code = PrintError(done.error());
  });

  CLI::App* keys = config.add_subcommand(
      "keys", "print every key with its meaning, range and default, as a trammel.toml");
  keys->callback([] { fmt::print("{}", files::DescribeConfigKeys()); });
}

}  // namespace trammel::app
