#include "support/run_trammel.h"

#include <sys/wait.h>

#include <cstdio>
#include <stdexcept>

#include "support/sanitized.h"

namespace trammel::test {

CommandResult RunTrammel(const std::string& arguments, const std::filesystem::path& folder,
                         const RunLimits& limits) {
  const TemporaryFolder aside;
  const std::filesystem::path errors = aside.path() / "stderr";
  std::string command = "cd '" + folder.string() + "' && export XDG_STATE_HOME='" +
                        (folder / "state").string() + "' && ";
  if (limits.memory_kb > 0 && !kSanitized) {  // sanitizers take terabytes of addresses
    command += "ulimit -v " + std::to_string(limits.memory_kb) + " && ";
  }
  const bool sim = arguments.starts_with("sim ");
  command += sim ? "'" TRAMMEL_SIM_BINARY "' " : "'" TRAMMEL_BINARY "' ";
  command += arguments.substr(sim ? 4 : 0) + " 2>'" + errors.string() + "' </dev/null";
  std::FILE* pipe = popen(command.c_str(), "r");
  if (pipe == nullptr) throw std::runtime_error("no shell to run: " + command);
  CommandResult result;
  char buffer[4096];
  while (const std::size_t count = std::fread(buffer, 1, sizeof(buffer), pipe)) {
    result.standard_output.append(buffer, count);
  }
  const int status = pclose(pipe);
  if (WIFEXITED(status)) result.exit_code = WEXITSTATUS(status);
  result.standard_error = ReadWhole(errors);
  result.output = result.standard_output + result.standard_error;
  return result;
}

}  // namespace trammel::test
