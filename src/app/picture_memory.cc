#include "app/picture_memory.h"

#include <malloc.h>

namespace trammel::app {

void KeepPicturesMemory() {
  constexpr int kMostOnHeapBytes = 32 << 20;  // glibc takes no more
  constexpr int kMostKeptBytes = 256 << 20;
  mallopt(M_MMAP_THRESHOLD, kMostOnHeapBytes);
  mallopt(M_TRIM_THRESHOLD, kMostKeptBytes);
}

}  // namespace trammel::app
