#include "part_alignment/commands/machine_boxes.h"

#include "app/option_values.h"
#include "base/check.h"

namespace trammel::app {
namespace {

using part_alignment::MachineBox;

constexpr std::size_t kNumbers = 6;

MachineBox BoxOf(const std::vector<double>& n, std::size_t from) {
  return {{n[from], n[from + 1], n[from + 2]}, {n[from + 3], n[from + 4], n[from + 5]}};
}

}  // namespace

void AddMachineBoxes(CLI::App& command, MachineBoxArguments& arguments, const std::string& group) {
  command
      .add_option("--travel", arguments.travel,
                  "of the spindle: the least X,Y,Z and the most X,Y,Z")
      ->expected(static_cast<int>(kNumbers))
      ->delimiter(',')
      ->group(group);
  command
      .add_option("--obstacle", arguments.obstacles,
                  "least X,Y,Z and most X,Y,Z of part or fixture; may be repeated")
      ->delimiter(',')
      ->group(group);
  command
      .add_option("--camera-radius", arguments.camera_radius_mm, "of what hangs in the spindle, mm")
      ->check(NumberIn(0.0, 1e4))
      ->capture_default_str()
      ->group(group);
  command
      .add_option("--camera-below", arguments.camera_below_mm,
                  "from the spindle's reference point to the camera's lower end, mm; 0: 30 mm "
                  "beyond the camera's origin by its file")
      ->check(NumberIn(0.0, 1e4))
      ->capture_default_str()
      ->group(group);
}

Result<std::vector<MachineBox>> ObstaclesOf(const MachineBoxArguments& arguments) {
  const std::vector<double>& n = arguments.obstacles;
  if (n.size() % kNumbers != 0) {
    return Fail("--obstacle takes six numbers: the least X, Y, Z and the most X, Y, Z");
  }
  std::vector<MachineBox> boxes;
  for (std::size_t i = 0; i < n.size(); i += kNumbers) boxes.push_back(BoxOf(n, i));
  return boxes;
}

MachineBox TravelOf(const MachineBoxArguments& arguments) {
  TRAMMEL_CHECK(arguments.travel.size() == kNumbers, "{} numbers", arguments.travel.size());
  return BoxOf(arguments.travel, 0);
}

}  // namespace trammel::app
