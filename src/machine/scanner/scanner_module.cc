#include "machine/scanner/scanner_module.h"

#include "machine/module/module.h"
#include "machine/scanner/sane_scan.h"

namespace {
constexpr trammel::machine::ScannerModule kModule = {trammel::machine::ListInChild,
                                                     trammel::machine::ScanInChild};
}  // namespace

TRAMMEL_MODULE(kModule)
