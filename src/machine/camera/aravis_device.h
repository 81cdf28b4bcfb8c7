// Finding and opening a GenICam camera. Includes Aravis, and with it GLib: for aravis_camera.cc.
#pragma once

#include <arv.h>

#include <memory>
#include <stop_token>
#include <string>

#include "base/result.h"

namespace trammel::machine {

struct Unref {
  void operator()(void* object) const { g_object_unref(object); }
};
/// Owns one reference to a GObject.
template <class T>
using Held = std::unique_ptr<T, Unref>;

/// The error of one call into Aravis.
class Trouble {
 public:
  Trouble() = default;
  ~Trouble() { g_clear_error(&error_); }
  Trouble(const Trouble&) = delete;
  Trouble& operator=(const Trouble&) = delete;

  /// To hand to a call; forgets the error before.
  [[nodiscard]] GError** out() {
    g_clear_error(&error_);
    return &error_;
  }
  [[nodiscard]] bool occurred() const { return error_ != nullptr; }
  [[nodiscard]] bool IsNotFound() const {
    return g_error_matches(error_, ARV_DEVICE_ERROR, ARV_DEVICE_ERROR_NOT_FOUND) != FALSE;
  }
  [[nodiscard]] std::string text() const {
    return error_ != nullptr && error_->message != nullptr ? error_->message : "no reason given";
  }

 private:
  GError* error_ = nullptr;
};

struct OpenedArvCamera {
  Held<ArvCamera> camera;
  std::string id;  ///< as asked for, or that of the only camera
};

/// Looks on all network interfaces and the USB; that takes one to a few seconds, which `stop` does
/// not shorten.
/// @param id  as arv-tool lists it, a serial number, or an IP address; empty: the only camera.
/// @returns errors: kMachine with those that are there, where there is none of that id, or several
///          and no id; kMachine where it does not open; kInterrupted.
[[nodiscard]] Result<OpenedArvCamera> OpenArvCamera(const std::string& id,
                                                    const std::stop_token& stop);

}  // namespace trammel::machine
