// Suspends a call of the module until something that it waits for has arrived.

let resume;
let isWoken = false;

/** Ends the wait, or the next one. */
export function wake() {
  isWoken = true;
  resume?.();
}

/** Whether a call can be suspended: by JavaScript Promise Integration. */
export const canSuspend = typeof WebAssembly.Suspending === "function";

const wait = () =>
  new Promise((resolve) => {
    // The shortest time that browsers keep to.
    const late = setTimeout(() => resume(), 4);
    resume = () => {
      clearTimeout(late);
      resume = undefined;
      isWoken = false;
      resolve();
    };
    if (isWoken) resume();
  });

export const suspend = canSuspend ? new WebAssembly.Suspending(wait) : () => {};
