#include "sim/camera/machine_wire.h"

#include <fmt/format.h>

#include <cmath>
#include <cstring>
#include <type_traits>
#include <utility>

namespace trammel::sim {
namespace {

constexpr std::string_view kGreeting = "trammel machine 1";
constexpr double kFarthestMm = 1e4;
constexpr double kFastestMmS = 1e6;
constexpr std::size_t kMostStrands = 1'000'000;  // as many as moves in a print
constexpr std::size_t kSampleBytes = 5 * sizeof(double);

enum class Kind : std::uint8_t { kWorld, kView, kBed, kCamera };

class Writer {
 public:
  template <class T>
  Writer& Put(const T& value) {
    static_assert(std::is_arithmetic_v<T> || std::is_enum_v<T>);
    char raw[sizeof(T)];
    std::memcpy(raw, &value, sizeof(T));
    bytes_.append(raw, sizeof(T));
    return *this;
  }
  Writer& Text(std::string_view text) {
    bytes_.append(text);
    return *this;
  }
  void Reserve(std::size_t bytes) { bytes_.reserve(bytes); }
  [[nodiscard]] std::string Take() { return std::move(bytes_); }

 private:
  std::string bytes_;
};

// Reads on after an error, but only zeros; whether all was well is asked at the end.
class Reader {
 public:
  explicit Reader(std::string_view bytes) : rest_(bytes) {}

  template <class T>
  [[nodiscard]] T Take() {
    static_assert(std::is_arithmetic_v<T>);
    T value{};
    if (rest_.size() < sizeof(T)) {
      Refuse();
      return value;
    }
    std::memcpy(&value, rest_.data(), sizeof(T));
    rest_.remove_prefix(sizeof(T));
    return value;
  }
  [[nodiscard]] double Number(double lo, double hi) {
    const auto value = Take<double>();
    if (value >= lo && value <= hi) return value;
    Refuse();
    return lo;
  }
  [[nodiscard]] double Place() { return Number(-kFarthestMm, kFarthestMm); }
  [[nodiscard]] double Size() { return Number(0, kFarthestMm); }
  /// A whole number below `count`.
  [[nodiscard]] int Choice(int count) {
    const auto value = Take<std::uint8_t>();
    if (value < count) return value;
    Refuse();
    return 0;
  }
  [[nodiscard]] bool Flag() { return Choice(2) == 1; }
  /// A number of things of which each takes at least so many of the bytes that are left.
  [[nodiscard]] std::size_t Count(std::size_t most, std::size_t bytes_each) {
    const std::size_t count = Take<std::uint32_t>();
    if (count <= most && count <= rest_.size() / bytes_each) return count;
    Refuse();
    return 0;
  }
  void Expect(std::string_view text) {
    if (!rest_.starts_with(text)) return Refuse();
    rest_.remove_prefix(text.size());
  }
  void Refuse() {
    good_ = false;
    rest_ = {};
  }
  [[nodiscard]] std::size_t left() const { return rest_.size(); }
  /// Everything was there, within its bounds, and nothing more.
  [[nodiscard]] bool good() const { return good_ && rest_.empty(); }

 private:
  std::string_view rest_;
  bool good_ = true;
};

tl::unexpected<Error> Wrong(const char* what, std::string_view bytes) {
  return Fail(fmt::format("{} bytes that are not {}", bytes.size(), what), ErrorKind::kMachine);
}

Strand TakeStrand(Reader& reader) {
  Strand strand;
  strand.samples.resize(reader.Count(kLongestAnswer, kSampleBytes));
  for (BeadSample& sample : strand.samples) {
    sample.x_mm = reader.Place();
    sample.y_mm = reader.Place();
    sample.area_mm2 = reader.Size();
    sample.width_mm = reader.Size();
    sample.height_mm = reader.Size();
  }
  return strand;
}

}  // namespace

std::string Encode(const Question& question) {
  Writer writer;
  if (std::holds_alternative<WorldQuestion>(question)) {
    writer.Put(Kind::kWorld).Text(kGreeting);
  } else if (const auto* view = std::get_if<ViewQuestion>(&question)) {
    writer.Put(Kind::kView).Put(view->monotonic_s);
  } else if (const auto* bed = std::get_if<BedQuestion>(&question)) {
    writer.Put(Kind::kBed).Put(bed->monotonic_s).Put(bed->known_version);
  } else {
    writer.Put(Kind::kCamera).Put(std::get<CameraNotice>(question).port);
  }
  return writer.Take();
}

std::string Encode(const MachineWorld& world) {
  Writer writer;
  writer.Text(kGreeting).Put(world.seed).Put(world.speed);
  writer.Put(static_cast<std::uint8_t>(world.condition.plate));
  writer.Put(static_cast<std::uint8_t>(world.condition.filament));
  writer.Put(static_cast<std::uint8_t>(world.condition.ambient));
  return writer.Take();
}

std::string Encode(const MachineView& view) {
  Writer writer;
  writer.Put(view.x_mm).Put(view.y_mm).Put(view.z_mm).Put(view.speed_mm_s);
  writer.Put(static_cast<std::uint8_t>(view.laser_on));
  writer.Put(static_cast<std::uint8_t>(view.lights_on));
  return writer.Take();
}

std::string Encode(const BedAnswer& answer) {
  Writer writer;
  writer.Put(answer.version);
  if (answer.bed == nullptr) return writer.Take();
  const Bed& bed = *answer.bed;
  std::size_t bytes = 64;
  for (const Strand& strand : bed.strands) bytes += 4 + strand.samples.size() * kSampleBytes;
  writer.Reserve(bytes);
  writer.Put(bed.size_x_mm).Put(bed.size_y_mm);
  writer.Put(static_cast<std::uint32_t>(bed.strands.size()));
  for (const Strand& strand : bed.strands) {
    writer.Put(static_cast<std::uint32_t>(strand.samples.size()));
    for (const BeadSample& sample : strand.samples) {
      writer.Put(sample.x_mm).Put(sample.y_mm).Put(sample.area_mm2);
      writer.Put(sample.width_mm).Put(sample.height_mm);
    }
  }
  return writer.Take();
}

Result<Question> DecodeQuestion(std::string_view bytes) {
  Reader reader(bytes);
  Question question;
  const auto time_s = [&] { return reader.Number(-1e12, 1e12); };
  switch (static_cast<Kind>(reader.Take<std::uint8_t>())) {
    case Kind::kWorld:
      reader.Expect(kGreeting);
      break;
    case Kind::kView:
      question = ViewQuestion{time_s()};
      break;
    case Kind::kBed: {
      const double monotonic_s = time_s();
      question = BedQuestion{monotonic_s, reader.Take<std::uint64_t>()};
      break;
    }
    case Kind::kCamera: {
      const CameraNotice notice{reader.Take<std::uint16_t>()};
      if (notice.port == 0) reader.Refuse();
      question = notice;
      break;
    }
    default:
      reader.Refuse();
  }
  if (!reader.good()) return Wrong("a question to a machine", bytes);
  return question;
}

Result<MachineWorld> DecodeWorld(std::string_view bytes) {
  Reader reader(bytes);
  reader.Expect(kGreeting);
  MachineWorld world;
  world.seed = reader.Take<std::uint64_t>();
  world.speed = reader.Number(0.1, 1000);
  world.condition.plate = static_cast<Plate>(reader.Choice(3));
  world.condition.filament = static_cast<Filament>(reader.Choice(2));
  world.condition.ambient = reader.Flag();
  if (!reader.good()) return Wrong("a virtual printer's greeting", bytes);
  return world;
}

Result<MachineView> DecodeView(std::string_view bytes) {
  Reader reader(bytes);
  MachineView view;
  view.x_mm = reader.Place();
  view.y_mm = reader.Place();
  view.z_mm = reader.Place();
  view.speed_mm_s = reader.Number(0, kFastestMmS);
  view.laser_on = reader.Flag();
  view.lights_on = reader.Flag();
  if (!reader.good()) return Wrong("a machine's state", bytes);
  return view;
}

Result<BedAnswer> DecodeBed(std::string_view bytes) {
  Reader reader(bytes);
  BedAnswer answer;
  answer.version = reader.Take<std::uint64_t>();
  if (answer.version == 0) reader.Refuse();
  if (reader.left() > 0) {
    Bed bed;
    bed.size_x_mm = reader.Size();
    bed.size_y_mm = reader.Size();
    bed.strands.resize(reader.Count(kMostStrands, sizeof(std::uint32_t)));
    for (Strand& strand : bed.strands) strand = TakeStrand(reader);
    answer.bed = std::make_shared<const Bed>(std::move(bed));
  }
  if (!reader.good()) return Wrong("a machine's bed", bytes);
  return answer;
}

}  // namespace trammel::sim
