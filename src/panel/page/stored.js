// Choices that outlast a visit, and results that outlast a reload. A browser may offer no storage, or throw: then nothing is
// remembered.

const local = () => localStorage;
const session = () => sessionStorage;

function read(storage, key, otherwise) {
  try {
    return storage().getItem(`trammel.${key}`) ?? otherwise;
  } catch {
    return otherwise;
  }
}

function write(storage, key, text) {
  try {
    storage().setItem(`trammel.${key}`, text);
  } catch {
    // Not remembered.
  }
}

export const remembered = (key, otherwise = "") => read(local, key, otherwise);
export const remember = (key, text) => write(local, key, text);
export const rememberedInVisit = (key, otherwise = "") => read(session, key, otherwise);
export const rememberInVisit = (key, text) => write(session, key, text);
