#include "machine/camera/aravis_device.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <vector>

namespace trammel::machine {
namespace {

std::string TextOf(const char* text) { return text != nullptr ? text : ""; }

struct FoundCamera {
  std::string id;
  std::string line;  ///< for a list: the id, and how it is connected
};

std::vector<FoundCamera> LookForCameras() {
  std::vector<FoundCamera> found;
  arv_update_device_list();
  constexpr unsigned kMost = 32;
  const unsigned count = std::min(arv_get_n_devices(), kMost);
  for (unsigned i = 0; i < count; ++i) {
    FoundCamera camera;
    camera.id = TextOf(arv_get_device_id(i));
    camera.line = fmt::format("aravis:{} ({}, {})", camera.id, TextOf(arv_get_device_protocol(i)),
                              TextOf(arv_get_device_address(i)));
    found.push_back(std::move(camera));
  }
  return found;
}

std::string ListOf(const std::vector<FoundCamera>& cameras) {
  std::string list;
  for (const FoundCamera& camera : cameras) list += (list.empty() ? "" : ", ") + camera.line;
  return list;
}

constexpr const char* kWhereToLook =
    "check power and cable; a GigE camera must have an address in the network of this machine's "
    "interface, and no firewall before it; a USB camera needs a udev rule that lets the user open "
    "it";

tl::unexpected<Error> NotThere(const std::string& id) {
  const std::vector<FoundCamera> cameras = LookForCameras();
  return Fail(fmt::format("camera aravis:{}: there is no such camera; {}", id,
                          cameras.empty() ? fmt::format("none was found: {}", kWhereToLook)
                                          : fmt::format("there are: {}", ListOf(cameras))),
              ErrorKind::kMachine);
}

Result<std::string> TheOnlyCamera() {
  const std::vector<FoundCamera> cameras = LookForCameras();
  if (cameras.size() == 1) return cameras.front().id;
  if (cameras.empty()) {
    return Fail(fmt::format("camera aravis: no camera was found; {}", kWhereToLook),
                ErrorKind::kMachine);
  }
  return Fail(
      fmt::format("camera aravis: several cameras are there, name one of: {}", ListOf(cameras)),
      ErrorKind::kMachine);
}

}  // namespace

Result<OpenedArvCamera> OpenArvCamera(const std::string& id, const std::stop_token& stop) {
  std::string chosen = TRY(id.empty() ? TheOnlyCamera() : Result<std::string>(id));
  const auto stopped = [&] {
    return Fail(fmt::format("camera aravis:{}: stopped", chosen), ErrorKind::kInterrupted);
  };
  if (stop.stop_requested()) return stopped();
  Trouble trouble;
  Held<ArvCamera> camera(arv_camera_new(chosen.c_str(), trouble.out()));
  if (stop.stop_requested()) return stopped();
  if (camera && !trouble.occurred()) return OpenedArvCamera{std::move(camera), chosen};
  if (!camera && (trouble.IsNotFound() || !trouble.occurred())) return NotThere(chosen);
  return Fail(fmt::format("camera aravis:{}: does not open ({}); is it in use by another program, "
                          "or may the user not open it?",
                          chosen, trouble.text()),
              ErrorKind::kMachine);
}

}  // namespace trammel::machine
