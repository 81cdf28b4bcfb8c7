// trammel pa study: the paper's own study, run in the virtual world.
#pragma once

namespace CLI {
class App;
}

namespace trammel::app {

/// Hangs `study` below `trammel pa`.
void AddPressureAdvanceStudy(CLI::App& pa, int& exit_code);

}  // namespace trammel::app
