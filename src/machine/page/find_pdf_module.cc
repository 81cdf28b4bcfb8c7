#include "machine/module/module.h"
#include "machine/page/pdf_module.h"

namespace trammel::machine {

Result<const PdfModule*> FindPdfModule() { return LoadModule<PdfModule>(kPdfModule); }

}  // namespace trammel::machine
