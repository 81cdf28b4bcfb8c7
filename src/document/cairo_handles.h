// Owning handles of Cairo's objects, and the bytes that it writes.
#pragma once

#include <cairo.h>

#include <exception>
#include <memory>
#include <string>

namespace trammel::report {

struct SurfaceDeleter {
  void operator()(cairo_surface_t* surface) const { cairo_surface_destroy(surface); }
};
struct ContextDeleter {
  void operator()(cairo_t* context) const { cairo_destroy(context); }
};
using Surface = std::unique_ptr<cairo_surface_t, SurfaceDeleter>;
using Context = std::unique_ptr<cairo_t, ContextDeleter>;

/// Appends Cairo's output to the std::string behind `closure`: a cairo_write_func_t, which must not
/// throw.
inline cairo_status_t AppendBytes(void* closure, const unsigned char* data,
                                  unsigned int length) noexcept {
  try {
    static_cast<std::string*>(closure)->append(reinterpret_cast<const char*>(data), length);
    return CAIRO_STATUS_SUCCESS;
  } catch (const std::exception&) {
    return CAIRO_STATUS_NO_MEMORY;
  }
}

}  // namespace trammel::report
