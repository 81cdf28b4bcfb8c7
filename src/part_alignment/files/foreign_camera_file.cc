#include "part_alignment/files/foreign_camera_file.h"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "files/foreign_text.h"
#include "files/json_object.h"
#include "files/whole_file.h"

namespace trammel::files {
namespace {

using nlohmann::json;
using part_alignment::OpenCvCamera;

// Collects a matrix's numbers in any form: nested lists, {rows, cols, data}, a text of words.
bool Collect(const json& value, std::vector<double>& numbers) {
  constexpr std::size_t kMax = 64;
  if (numbers.size() > kMax) return false;
  if (value.is_number()) {
    numbers.push_back(value.get<double>());
    return true;
  }
  if (value.is_object()) return value.contains("data") && Collect(value["data"], numbers);
  if (value.is_array()) {
    for (const json& entry : value) {
      if (!Collect(entry, numbers)) return false;
    }
    return true;
  }
  if (!value.is_string()) return false;
  const std::string& text = value.get_ref<const std::string&>();
  const char* at = text.data();
  const char* const end = at + text.size();
  while (at != end) {
    if (*at == ' ' || *at == '\n' || *at == '\t' || *at == '\r') {
      ++at;
      continue;
    }
    double number = 0;
    const auto read = std::from_chars(at, end, number);
    if (read.ec != std::errc{} || numbers.size() > kMax) return false;
    numbers.push_back(number);
    at = read.ptr;
  }
  return true;
}

struct Found {
  std::string key;
  std::vector<double> numbers;
};

// Finds the first of these keys that exists, with finite numbers.
Result<std::optional<Found>> Find(const json& root, const std::string& file,
                                  std::initializer_list<const char*> keys) {
  for (const char* key : keys) {
    if (!root.contains(key)) continue;
    Found found{key, {}};
    bool sound = Collect(root[key], found.numbers);
    for (const double number : found.numbers) sound = sound && std::isfinite(number);
    if (!sound) {
      return Fail(
          fmt::format("{}: {} is {}; it must be finite numbers", file, key, Show(root[key])));
    }
    return found;
  }
  return std::optional<Found>();
}

Result<void> SetSize(const std::vector<double>& size, const std::string& file,
                     OpenCvCamera& camera) {
  constexpr double kMax_px = 100'000;
  for (const double side : size) {
    if (!(side >= 1 && side <= kMax_px) || side != std::floor(side)) {
      return Fail(
          fmt::format("{}: the picture's size {} must be whole, 1 … {} px", file, side, kMax_px));
    }
  }
  if (size.size() != 2)
    return Fail(fmt::format("{}: the picture's size has not two numbers", file));
  camera.width_px = static_cast<int>(size[0]);
  camera.height_px = static_cast<int>(size[1]);
  return {};
}

// k1 k2 p1 p2 [k3 [k4 k5 k6 [thin prism and tilt]]]
Result<void> SetDistortion(const std::vector<double>& d, const std::string& file,
                           OpenCvCamera& camera) {
  if (d.size() != 0 && d.size() != 4 && d.size() != 5 && d.size() != 8 && d.size() != 12 &&
      d.size() != 14) {
    return Fail(fmt::format("{}: {} distortion coefficients; OpenCV has 0, 4, 5, 8, 12 or 14", file,
                            d.size()));
  }
  for (std::size_t i = 8; i < d.size(); ++i) {
    if (d[i] != 0) {
      return Fail(
          fmt::format("{}: distortion coefficient {} is {}: thin prisms and tilted sensors "
                      "cannot be converted; calibrate with at most eight coefficients",
                      file, i + 1, d[i]));
    }
  }
  const std::array<double*, 8> members{&camera.k1, &camera.k2, &camera.p1, &camera.p2,
                                       &camera.k3, &camera.k4, &camera.k5, &camera.k6};
  for (std::size_t i = 0; i < std::min(members.size(), d.size()); ++i) *members[i] = d[i];
  return {};
}

Result<OpenCvCamera> FromMrcal(const json& root, const std::string& file) {
  if (!root["lensmodel"].is_string()) return Fail(fmt::format("{}: lensmodel is no text", file));
  const auto model = root["lensmodel"].get<std::string>();
  std::size_t coefficients = 0;
  if (model == "LENSMODEL_OPENCV4") coefficients = 4;
  if (model == "LENSMODEL_OPENCV5") coefficients = 5;
  if (model == "LENSMODEL_OPENCV8") coefficients = 8;
  if (coefficients == 0 && model != "LENSMODEL_PINHOLE") {
    return Fail(fmt::format(
        "{}: lensmodel {} cannot be converted: PINHOLE, OPENCV4, OPENCV5 or OPENCV8 can "
        "(mrcal-convert-lensmodel makes one)",
        file, Show(root["lensmodel"])));
  }
  const auto intrinsics = TRY(Find(root, file, {"intrinsics"}));
  if (!intrinsics || intrinsics->numbers.size() != 4 + coefficients) {
    return Fail(
        fmt::format("{}: intrinsics must be {} numbers for {}", file, 4 + coefficients, model));
  }
  const auto size = TRY(Find(root, file, {"imagersize"}));
  if (!size) return Fail(fmt::format("{}: imagersize is missing", file));
  OpenCvCamera camera;
  TRY(SetSize(size->numbers, file, camera));
  const std::vector<double>& n = intrinsics->numbers;
  camera.fx_px = n[0];
  camera.fy_px = n[1];
  camera.cx_px = n[2];
  camera.cy_px = n[3];
  TRY(SetDistortion({n.begin() + 4, n.end()}, file, camera));
  return camera;
}

Result<void> ReadOpenCvSize(const json& root, const std::string& file, OpenCvCamera& camera) {
  const auto width = TRY(Find(root, file, {"image_width", "image_Width", "width"}));
  const auto height = TRY(Find(root, file, {"image_height", "image_Height", "height"}));
  if (width && height) {
    std::vector<double> size = width->numbers;
    size.insert(size.end(), height->numbers.begin(), height->numbers.end());
    return SetSize(size, file, camera);
  }
  const auto both = TRY(Find(root, file, {"image_size", "imageSize", "img_shape", "resolution"}));
  if (both) return SetSize(both->numbers, file, camera);
  return Fail(
      fmt::format("{}: the picture's size (image_width, image_height) is missing: add it", file));
}

// Reduces a name to lower-case letters and digits: "Plumb Bob" and plumb_bob are one name.
std::string Plain(const std::string& name) {
  std::string plain;
  for (const char letter : name) {
    if (letter >= 'A' && letter <= 'Z') plain += static_cast<char>(letter - 'A' + 'a');
    if ((letter >= 'a' && letter <= 'z') || (letter >= '0' && letter <= '9')) plain += letter;
  }
  return plain;
}

// True if a key may name the lens's model, in any program's file. xi is of cv::omnidir.
bool MayNameModel(const std::string& plain_key) {
  if (plain_key == "xi") return true;
  for (const char* part : {"model", "fisheye", "omnidir", "distortiontype", "lenstype",
                           "cameratype", "projectiontype"}) {
    if (plain_key.find(part) != std::string::npos) return true;
  }
  return false;
}

// True for the names of OpenCV's usual model, and for a denied other one (fisheye_model: 0).
bool IsUsualModel(const std::string& plain_key, const json& value) {
  if (value.is_null()) return true;
  const bool of_other = plain_key == "xi" || plain_key.find("fisheye") != std::string::npos ||
                        plain_key.find("omnidir") != std::string::npos;
  if (of_other && value.is_boolean()) return !value.get<bool>();
  if (of_other && value.is_number()) return value.get<double>() == 0;
  if (!value.is_string()) return false;
  const std::string name = Plain(value.get<std::string>());
  if (of_other) return name == "0" || name == "false" || name == "no";
  for (const char* known : {"", "plumbbob", "rationalpolynomial", "radtan", "radialtangential",
                            "pinhole", "pinholeradtan", "brown", "perspective"}) {
    if (name == known) return true;
  }
  return false;
}

// Checks the model: coefficients of another model have the same number and another meaning, so only
// known models are converted.
Result<void> CheckModel(const json& root, const std::string& file) {
  for (const auto& [key, value] : root.items()) {
    const std::string plain_key = Plain(key);
    if (!MayNameModel(plain_key) || IsUsualModel(plain_key, value)) continue;
    return Fail(fmt::format(
        "{}: {} is {}, a lens model that cannot be converted: plumb_bob, rational_polynomial, "
        "radtan, pinhole and brown can (cv::calibrateCamera makes one; cv::fisheye does not); "
        "calibrate so, or remove {} where it does not name the lens's model",
        file, key, Show(value), key));
  }
  return {};
}

Result<OpenCvCamera> FromOpenCvFile(const json& root, const std::string& file) {
  TRY(CheckModel(root, file));
  const auto matrix = TRY(Find(root, file,
                               {"camera_matrix", "Camera_Matrix", "cameraMatrix", "CameraMatrix",
                                "intrinsic_matrix", "mtx", "K", "M1"}));
  if (!matrix || matrix->numbers.size() != 9) {
    return Fail(
        fmt::format("{}: there is no camera_matrix of nine numbers, and no lensmodel", file));
  }
  const std::vector<double>& m = matrix->numbers;
  if (m[1] != 0 || m[3] != 0 || m[6] != 0 || m[7] != 0 || m[8] != 1) {
    return Fail(fmt::format("{}: {} is not [fx 0 cx; 0 fy cy; 0 0 1]; skew cannot be converted",
                            file, matrix->key));
  }
  OpenCvCamera camera;
  camera.fx_px = m[0];
  camera.cx_px = m[2];
  camera.fy_px = m[4];
  camera.cy_px = m[5];
  const auto distortion =
      TRY(Find(root, file,
               {"distortion_coefficients", "Distortion_Coefficients", "distCoeffs", "dist_coeffs",
                "dist_coeff", "DistortionCoefficients", "distortion", "dist", "D", "D1"}));
  if (distortion) {
    TRY(SetDistortion(distortion->numbers, file, camera));
  }
  TRY(ReadOpenCvSize(root, file, camera));
  return camera;
}

}  // namespace

Result<OpenCvCamera> ParseForeignCamera(std::string_view text, const std::string& file) {
  const bool mrcal = text.find("lensmodel") != std::string_view::npos;
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  const char begin = first == std::string_view::npos ? '\0' : text[first];
  const auto root = TRY(mrcal          ? ParseLiteral(text, file)
                        : begin == '<' ? ParsePlainXml(text, file)
                        : begin == '{' ? ParseJson(text, file)
                                       : ParsePlainYaml(text, file));
  if (!root.is_object()) {
    return Fail(fmt::format("{}: is {}; it must be a camera file", file, Show(root)));
  }
  return mrcal && root.contains("lensmodel") ? FromMrcal(root, file) : FromOpenCvFile(root, file);
}

Result<OpenCvCamera> ReadForeignCameraFile(const std::filesystem::path& path) {
  constexpr std::size_t kMaxBytes = 32'000'000;  // mrcal keeps its inputs in the file
  const auto text = TRY(ReadWholeFile(path, kMaxBytes));
  return ParseForeignCamera(text, path.string());
}

}  // namespace trammel::files
