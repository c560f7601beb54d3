import { openUnderPolicy } from "./policed";
import workerAddress from "./worker?worker&url";

/** The thread beside the page. */
export const openWorker = (): Worker => openUnderPolicy(workerAddress);
