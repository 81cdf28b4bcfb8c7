import { useEffect } from "preact/hooks";

/** Calls `next` once, `pauseMs` after `answer` changed and while somebody looks at the page. Without an answer it waits. */
export function useNext(answer, pauseMs, next) {
  useEffect(() => {
    if (!answer) return;
    const look = () => {
      if (document.hidden) return;
      end();
      next();
    };
    const timer = setTimeout(look, pauseMs);
    const end = () => {
      clearTimeout(timer);
      document.removeEventListener("visibilitychange", look);
    };
    document.addEventListener("visibilitychange", look);
    return end;
  }, [answer]);
}
