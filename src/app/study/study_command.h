// trammel pa study: the paper's own study, run in the virtual world.
#pragma once

namespace CLI {
class App;
}

namespace trammel::app {

/// Hangs `study` below `trammel pa`. REQUIRES that `cli` has the group.
void AddPressureAdvanceStudy(CLI::App& cli, int& exit_code);

}  // namespace trammel::app
