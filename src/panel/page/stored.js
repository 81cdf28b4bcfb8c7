// Choices that outlast the visit. A browser may offer no storage, or throw: then nothing is remembered.

export function remembered(key, otherwise = "") {
  try {
    return localStorage.getItem(`trammel.${key}`) ?? otherwise;
  } catch {
    return otherwise;
  }
}

export function remember(key, text) {
  try {
    localStorage.setItem(`trammel.${key}`, text);
  } catch {
    // Not remembered.
  }
}
