#include "machine/cad/step_module.h"
#include "machine/module/module.h"

namespace trammel::machine {

Result<const StepModule*> FindStepModule() { return LoadModule<StepModule>(kStepModule); }

}  // namespace trammel::machine
