// LinuxCNC's shell server (linuxcncrsh) as recorded from LinuxCNC 2.9, on a loopback socket, with a
// machine of three axes and C behind it that moves in real time; and with faults.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace trammel::test {

class ScriptedLinuxCnc {
 public:
  enum class Fault {
    kNone,
    kDrop,    ///< closes the connection instead of answering
    kSilent,  ///< never answers this one
    kRefuse,  ///< NAK, and the reason for those who ask
    kNoise,   ///< answers with what is no answer
  };
  /// Asked for every request of a client before it is answered.
  using Script = std::function<Fault(const std::string& request)>;

  explicit ScriptedLinuxCnc(Script script = nullptr);
  ~ScriptedLinuxCnc();
  ScriptedLinuxCnc(const ScriptedLinuxCnc&) = delete;
  ScriptedLinuxCnc& operator=(const ScriptedLinuxCnc&) = delete;

  [[nodiscard]] std::uint16_t port() const { return port_; }
  /// What `get NAME` answers, in the server's own capitals; "spindle 0" -> "0 FORWARD".
  void Answer(const std::string& name, const std::string& value);
  /// How much faster than asked the machine moves.
  void SetHurry(double factor);
  /// A value of the INI file, as in "[AXIS_X]MIN_LIMIT"; without one it shows "######".
  void SetIni(const std::string& name, const std::string& value);
  /// Beyond it a move is refused, as by a soft limit.
  void SetTravel(double half_mm);
  [[nodiscard]] std::vector<std::string> requests() const;
  /// X, Y, Z now, mm.
  [[nodiscard]] std::array<double, 3> position() const;
  [[nodiscard]] bool moving() const;
  /// A parameter (#5221 …) of the interpreter.
  [[nodiscard]] double parameter(int number) const;
  void SetParameter(int number, double value);

 private:
  void Serve();
  void Talk(int fd);
  /// What goes back for one request, with its line end.
  std::string Reply(const std::string& request, Fault fault);
  std::string ReplyToSet(const std::string& what, Fault fault);
  void Mdi(const std::string& text);
  void Move(const std::string& text);
  [[nodiscard]] double Progress() const;
  [[nodiscard]] std::array<double, 3> PositionNow() const;

  Script script_;
  std::uint16_t port_ = 0;
  int listener_ = -1;
  int wake_ = -1;
  mutable std::mutex mutex_;
  std::map<std::string, std::string> answers_;
  std::map<std::string, std::string> ini_;
  std::map<int, double> parameters_;
  std::vector<std::string> requests_;
  std::string error_ = "OK";
  std::string display_ = "OK";
  bool metric_ = true;
  double travel_mm_ = 1e9;
  double hurry_ = 1;
  std::array<double, 3> from_{};
  std::array<double, 3> to_{};
  double start_s_ = 0;
  double duration_s_ = 0;
  std::thread thread_;
};

}  // namespace trammel::test
