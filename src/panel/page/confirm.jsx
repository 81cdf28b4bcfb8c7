import { useEffect, useRef } from "preact/hooks";
import { texts } from "./texts.js";

/** A dialog that is open while `open` holds. Escape and the first button close it. */
export function Dialog({ open, close, title, children, ...rest }) {
  const dialog = useRef();
  useEffect(() => {
    if (open && !dialog.current.open) {
      dialog.current.showModal();
      dialog.current.querySelector(".focus")?.focus();
    }
    if (!open && dialog.current.open) dialog.current.close();
  }, [open]);
  return (
    <dialog ref={dialog} onClose={close} aria-label={title} {...rest}>
      {open && (
        <>
          <h2>{title}</h2>
          {children}
        </>
      )}
    </dialog>
  );
}

/** A question before something that heats, moves or stops. */
export function Confirm({ open, close, title, detail, yes, act, disabled, danger, children, ...rest }) {
  const confirmed = () => {
    close();
    act();
  };
  return (
    <Dialog open={open} close={close} title={title} {...rest}>
      <p>{detail}</p>
      {children}
      <p class="buttons">
        <button class={danger ? "danger" : "primary"} disabled={disabled} onClick={confirmed}>
          {yes}
        </button>
        <button class="focus" onClick={close}>
          {texts.cancel}
        </button>
      </p>
    </Dialog>
  );
}
