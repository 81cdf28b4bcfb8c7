// The helper in Python that joins LinuxCNC: session.py, as it was when this was built.
#pragma once

namespace trammel::machine {

extern const char* const kSessionScript;

}  // namespace trammel::machine
