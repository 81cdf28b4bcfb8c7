#include "machine/net/child_limits.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>

namespace trammel::machine {

void LimitThisProcess(std::uint64_t bytes, int seconds) {
  const auto most_s = static_cast<rlim_t>(seconds);
  const rlimit time{most_s, most_s + 1};
  setrlimit(RLIMIT_CPU, &time);
#ifndef TRAMMEL_SANITIZED
  unsigned long long pages = 0;
  std::FILE* const own = std::fopen("/proc/self/statm", "r");
  const bool known = own != nullptr && std::fscanf(own, "%llu", &pages) == 1;
  if (own != nullptr) std::fclose(own);
  if (!known) return;
  const rlim_t most = pages * static_cast<rlim_t>(sysconf(_SC_PAGESIZE)) + bytes;
  rlimit addresses{};
  getrlimit(RLIMIT_AS, &addresses);
  addresses.rlim_cur = std::min(addresses.rlim_cur, most);
  setrlimit(RLIMIT_AS, &addresses);
#else
  static_cast<void>(bytes);
#endif
}

}  // namespace trammel::machine
