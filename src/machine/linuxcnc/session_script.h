// Python helper that joins LinuxCNC: session.py as of this build.
#pragma once

namespace trammel::machine {

extern const char* const kSessionScript;

}  // namespace trammel::machine
