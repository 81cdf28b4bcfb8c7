// What the module with SANE does: trammel-scanner.so.
#pragma once

#include "machine/net/child_process.h"
#include "machine/scanner/scanner.h"

namespace trammel::machine {

/// Both are sane_scan.h's, for a process of their own.
struct ScannerModule {
  void (*list)(const ChildSender& sender);
  void (*scan)(const ScanRequest& request, const ChildSender& sender);
};

}  // namespace trammel::machine
