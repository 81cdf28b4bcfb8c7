#include "machine/scanner_module.h"

#include "machine/module.h"
#include "machine/sane_scan.h"

namespace {
constexpr trammel::machine::ScannerModule kModule = {trammel::machine::ListInChild,
                                                     trammel::machine::ScanInChild};
}  // namespace

TRAMMEL_MODULE(kModule)
