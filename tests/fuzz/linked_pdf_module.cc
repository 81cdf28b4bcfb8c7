// The module that reads PDFs, linked into the target instead of loaded.
#include "machine/page/pdf_module.h"

extern "C" const void* trammel_module();

namespace trammel::machine {

Result<const PdfModule*> FindPdfModule() { return static_cast<const PdfModule*>(trammel_module()); }

}  // namespace trammel::machine
