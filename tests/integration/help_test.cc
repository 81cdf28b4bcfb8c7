// trammel … --help, of every command that there is.
#include <gtest/gtest.h>

#include <cstddef>
#include <functional>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include "support/run_trammel.h"

namespace trammel {
namespace {

// Column of the description: two blanks, the words to type, then this, or the next line.
constexpr std::size_t kColumn = 30;

// The columns of what stands behind gaps of two blanks or more within a line.
std::vector<std::size_t> ColumnsBehindGaps(const std::string& line) {
  std::vector<std::size_t> columns;
  std::size_t column = 0;
  std::size_t blanks = 0;
  for (std::size_t i = line.find_first_not_of(' '); i < line.size(); ++i) {
    if (line[i] == ' ') {
      ++blanks;
    } else {
      if (blanks > 1) columns.push_back(column + line.find_first_not_of(' '));
      blanks = 0;
    }
    const bool inner = (static_cast<unsigned char>(line[i]) & 0xC0U) == 0x80U;  // UTF-8 inner byte
    if (!inner) ++column;
  }
  return columns;
}

TEST(Help, EachRowOfEveryCommandHasOneGapInOneColumn) {
  const test::TemporaryFolder folder;
  std::size_t commands = 0;
  const std::function<void(const std::string&)> look = [&](const std::string& path) {
    const test::CommandResult help = test::RunTrammel(path + " --help", folder.path());
    ASSERT_EQ(help.exit_code, 0) << path << help.output;
    ++commands;
    bool below = false;
    std::istringstream lines(help.standard_output);
    for (std::string line; std::getline(lines, line);) {
      const std::vector<std::size_t> columns = ColumnsBehindGaps(line);
      EXPECT_TRUE(columns.empty() || columns == std::vector{kColumn}) << path << ": " << line;
      static const std::regex row("^  ([a-z][a-z0-9-]*) .*");
      std::smatch command;
      if (below && std::regex_match(line, command, row)) look(path + " " + command[1].str());
      below = below || line == "Subcommands:";
    }
  };
  look("");
  look("sim ");
  EXPECT_GE(commands, 30U);
}

}  // namespace
}  // namespace trammel
