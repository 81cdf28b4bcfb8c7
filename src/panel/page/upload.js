// Sends files with their bytes unaltered. XMLHttpRequest, because fetch reports no progress of an upload.
import { texts } from "./texts.js";

const TYPES = {
  jpg: "image/jpeg",
  jpeg: "image/jpeg",
  png: "image/png",
  webp: "image/webp",
  heic: "image/heic",
  heif: "image/heif",
  tif: "image/tiff",
  tiff: "image/tiff",
  pdf: "application/pdf",
};

export const PHOTO_TYPES = "image/jpeg,image/png,image/webp,image/heic,image/heif";

/** Returns a file's media type. Some phones leave the type of HEIC files empty: then its name decides. */
export function mediaType(file) {
  if (file.type) return file.type;
  return TYPES[file.name.split(".").pop().toLowerCase()] ?? "application/octet-stream";
}

/** Promises the service's answer as an object. `progressed(bytes)` is called while the file is sent. */
export function send(address, file, type, { progressed, signal }) {
  return new Promise((resolve, reject) => {
    const request = new XMLHttpRequest();
    request.open("POST", address);
    request.setRequestHeader("Content-Type", type);
    request.upload.onprogress = ({ loaded }) => progressed(loaded);
    request.onerror = () => reject(new Error(texts.notSent));
    request.onabort = () => reject(new DOMException("", "AbortError"));
    request.onload = () => {
      const answer = objectIn(request.responseText);
      if (request.status >= 200 && request.status < 300 && answer) return resolve(answer);
      reject(new Error(answer?.error || texts.refusedUpload(request.status)));
    };
    signal.addEventListener("abort", () => request.abort());
    request.send(file);
  });
}

function objectIn(text) {
  try {
    return JSON.parse(text);
  } catch {
    return null;
  }
}
