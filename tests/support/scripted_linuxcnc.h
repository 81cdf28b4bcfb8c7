// A helper beside LinuxCNC (session.py) with a machine of three axes and C behind it that moves in
// real time; and with faults.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "support/temporary_folder.h"

namespace trammel::test {

class ScriptedLinuxCnc {
 public:
  enum class Fault {
    kNone,
    kDrop,    ///< the helper ends instead of answering
    kSilent,  ///< never answers this one
    kRefuse,  ///< an error, "refused by the script"
    kNoise,   ///< answers with what is no answer
  };
  /// Asked for every request, as the line that it is, before it is answered.
  using Script = std::function<Fault(const std::string& request)>;

  explicit ScriptedLinuxCnc(Script script = nullptr);
  ~ScriptedLinuxCnc();
  ScriptedLinuxCnc(const ScriptedLinuxCnc&) = delete;
  ScriptedLinuxCnc& operator=(const ScriptedLinuxCnc&) = delete;

  /// The program to be started as the helper; each is another client of this machine.
  [[nodiscard]] std::string helper() const { return (folder_.path() / "helper").string(); }
  /// Sets a member of its answers from now on: "estop", "homed", "position", "mode" …; of
  /// "position" also "c".
  void Answer(const std::string& member, nlohmann::json value);
  /// Sets the machine's speed relative to the command.
  void SetHurry(double factor);
  /// A value of the INI file, as in "[AXIS_X]MIN_LIMIT"; without one it shows "######".
  void SetIni(const std::string& name, const std::string& value);
  /// Beyond it a move is not begun, as by a soft limit.
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
  /// Returns the answer to one request, without its line end.
  std::string Reply(const std::string& request, Fault fault);
  nlohmann::json Do(const nlohmann::json& request);
  [[nodiscard]] nlohmann::json Look() const;
  void Mdi(const std::string& text);
  void Move(const std::string& text);
  [[nodiscard]] std::string Shown(const std::string& text);
  [[nodiscard]] double Progress() const;
  [[nodiscard]] std::array<double, 3> PositionNow() const;

  Script script_;
  TemporaryFolder folder_;
  int listener_ = -1;
  int wake_ = -1;
  mutable std::mutex mutex_;
  std::map<std::string, nlohmann::json> answers_;
  std::map<std::string, std::string> ini_;
  std::map<int, double> parameters_;
  std::vector<std::string> requests_;
  bool metric_ = true;
  double travel_mm_ = 1e9;
  double hurry_ = 1;
  double c_deg_ = 0;
  std::array<double, 3> from_{};
  std::array<double, 3> to_{};
  double start_s_ = 0;
  double duration_s_ = 0;
  std::thread thread_;
};

}  // namespace trammel::test
