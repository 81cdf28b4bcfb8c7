#include "real_linuxcnc.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <net/if.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <thread>

namespace trammel::test {
namespace {

namespace fs = std::filesystem;

constexpr const char* kProgram = "/usr/bin/linuxcnc";
constexpr const char* kLock = "/tmp/linuxcnc.lock";
constexpr double kStart_s = 60;  // it takes half a second on an idle computer

constexpr const char* kIni = R"([EMC]
MACHINE = trammel
VERSION = 1.1
[DISPLAY]
DISPLAY = {}
CYCLE_TIME = 0.02
[RS274NGC]
PARAMETER_FILE = t.var
[EMCMOT]
EMCMOT = motmod
COMM_TIMEOUT = 1.0
SERVO_PERIOD = 1000000
[TASK]
TASK = milltask
CYCLE_TIME = 0.01
[EMCIO]
EMCIO = io
CYCLE_TIME = 0.02
TOOL_TABLE = t.tbl
[HAL]
HALFILE = t.hal
[TRAJ]
COORDINATES = X Y Z C
LINEAR_UNITS = mm
ANGULAR_UNITS = degree
MAX_LINEAR_VELOCITY = 1000
[KINS]
KINEMATICS = trivkins coordinates=XYZC
JOINTS = 4
)";

constexpr const char* kHal = R"(loadrt [KINS]KINEMATICS
loadrt [EMCMOT]EMCMOT servo_period_nsec=[EMCMOT]SERVO_PERIOD num_joints=[KINS]JOINTS
addf motion-command-handler servo-thread
addf motion-controller servo-thread
net x joint.0.motor-pos-cmd => joint.0.motor-pos-fb
net y joint.1.motor-pos-cmd => joint.1.motor-pos-fb
net z joint.2.motor-pos-cmd => joint.2.motor-pos-fb
net c joint.3.motor-pos-cmd => joint.3.motor-pos-fb
net estop iocontrol.0.user-enable-out => iocontrol.0.emc-enable-in
net prepare iocontrol.0.tool-prepare => iocontrol.0.tool-prepared
net change iocontrol.0.tool-change => iocontrol.0.tool-changed
)";

std::string AxisSections() {
  std::string text;
  int joint = 0;
  for (const char axis : {'X', 'Y', 'Z', 'C'}) {
    const std::string limits =
        "MIN_LIMIT = -3000\nMAX_LIMIT = 3000\nMAX_VELOCITY = 1000\nMAX_ACCELERATION = 20000\n";
    text += fmt::format("[AXIS_{}]\n{}", axis, limits);
    // No search velocity: homed where it stands.
    text += fmt::format(
        "[JOINT_{}]\nTYPE = {}\n{}FERROR = 1\nMIN_FERROR = 1\nHOME = 0\nHOME_OFFSET = 0\n"
        "HOME_SEARCH_VEL = 0\nHOME_LATCH_VEL = 0\nHOME_SEQUENCE = 0\n",
        joint++, axis == 'C' ? "ANGULAR" : "LINEAR", limits);
  }
  return text;
}

void Wait(double s) { std::this_thread::sleep_for(std::chrono::duration<double>(s)); }

}  // namespace

std::string RealLinuxCnc::WhyNot() {
  if (access(kProgram, X_OK) != 0) {
    return fmt::format("{} is not there; install linuxcnc-uspace (packages-test.txt)", kProgram);
  }
  if (fs::exists(kLock)) {
    return fmt::format("{} is there: another LinuxCNC runs here, or one ended without removing it",
                       kLock);
  }
  return {};
}

bool RealLinuxCnc::EnterOwnNetwork() {
  if (unshare(CLONE_NEWNET) != 0) return false;
  const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  ifreq request{};
  std::strcpy(request.ifr_name, "lo");
  request.ifr_flags = IFF_UP | IFF_RUNNING;
  const bool up = ioctl(fd, SIOCSIFFLAGS, &request) == 0;
  close(fd);
  return up;
}

void RealLinuxCnc::WriteConfiguration() const {
  // A display is started with arguments of LinuxCNC's own.
  const fs::path screen = folder_.path() / "screen";
  WriteWhole(screen, fmt::format("#!/bin/sh\nexec /usr/bin/python3 {} {}\n",
                                 TRAMMEL_LINUXCNC_SCREEN, folder_.path().string()));
  fs::permissions(screen, fs::perms::owner_all);
  WriteWhole(folder_.path() / "t.ini", fmt::format(kIni, screen.string()) + AxisSections());
  WriteWhole(folder_.path() / "t.hal", kHal);
  WriteWhole(folder_.path() / "t.var", "");
  WriteWhole(folder_.path() / "t.tbl", "");
  const auto shared = fs::perms::all | fs::perms::sticky_bit;
  fs::permissions(folder_.path(), shared);
  fs::create_directory(folder_.path() / "fifo");
  fs::permissions(folder_.path() / "fifo", shared);
}

RealLinuxCnc::RealLinuxCnc() {
  WriteConfiguration();
  const std::string fifo = (folder_.path() / "fifo" / "rtapi").string();
  pid_ = fork();
  if (pid_ == 0) {
    setpgid(0, 0);
    if (chdir(folder_.path().c_str()) != 0) _exit(1);
    if (geteuid() == 0) {  // its real-time part does not run as root
      setenv("RTAPI_UID", "65534", 1);
      setenv("RTAPI_FIFO_PATH", fifo.c_str(), 1);
    }
    const int log = open("log", O_WRONLY | O_CREAT | O_TRUNC, 0600);
    const int nothing = open("/dev/null", O_RDONLY);
    dup2(nothing, STDIN_FILENO);
    dup2(log, STDOUT_FILENO);
    dup2(log, STDERR_FILENO);
    execl(kProgram, kProgram, "t.ini", nullptr);
    _exit(1);
  }
  constexpr double kLook_s = 0.1;
  for (double waited_s = 0; pid_ > 0 && !up_ && waited_s < kStart_s; waited_s += kLook_s) {
    if (waitpid(pid_, nullptr, WNOHANG) == pid_) {
      pid_ = -1;
      return;
    }
    up_ = ScreenIsUp();
    Wait(kLook_s);
  }
}

RealLinuxCnc::~RealLinuxCnc() {
  if (pid_ <= 0) return;
  // Its script waits for the screen to end, and cleans up after it.
  AskScreen("quit");
  constexpr double kLook_s = 0.1;
  constexpr double kEnd_s = 20;
  for (double waited_s = 0; waited_s < kEnd_s; waited_s += kLook_s) {
    if (waitpid(pid_, nullptr, WNOHANG) == pid_) return;
    Wait(kLook_s);
  }
  fmt::print(stderr, "LinuxCNC does not end; what is left of it, and {}, stay behind\n", kLock);
  kill(-pid_, SIGKILL);
  waitpid(pid_, nullptr, 0);
}

bool RealLinuxCnc::ScreenIsUp() const {
  // It takes what is asked once it has found the controller.
  const fs::path ask = folder_.path() / "ask";
  if (!fs::exists(folder_.path() / "told") && !fs::exists(ask)) AskScreen("look");
  return fs::exists(folder_.path() / "told");
}

void RealLinuxCnc::AskScreen(const std::string& words) const {
  fs::remove(folder_.path() / "told");
  WriteWhole(folder_.path() / "ask.new", words);
  fs::rename(folder_.path() / "ask.new", folder_.path() / "ask");
}

std::string RealLinuxCnc::ScreenText() const {
  const fs::path told = folder_.path() / "told";
  constexpr double kLook_s = 0.01;
  constexpr double kLimit_s = 20;
  for (double waited_s = 0; waited_s < kLimit_s && !fs::exists(told); waited_s += kLook_s) {
    Wait(kLook_s);
  }
  return fs::exists(told) ? ReadWhole(told) : std::string();
}

std::string RealLinuxCnc::log() const { return ReadWhole(folder_.path() / "log"); }

}  // namespace trammel::test
