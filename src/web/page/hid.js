// Devices that speak HID: the page asks the user for them, the lesson's worker opens them (`page_hid.rs` in the crate `app`).

const isOurs = ({ vendorId, productId, collections }, { vendor, products, usage }) => vendorId === vendor
  && (!products.length || products.includes(productId))
  && (!usage || collections.some(({ usagePage, usage: its }) => usagePage === usage[0] && its === usage[1]));

const filters = kinds => kinds.flatMap(({ vendor, products, usage }) => (products.length ? products : [undefined]).map(product => ({
  vendorId: vendor, ...(product && { productId: product }), ...(usage && { usagePage: usage[0], usage: usage[1] }),
})));

/** Interval at which a device is looked for that is not there: browsers tell of no permission, and forget some with the device, ms. */
const LOOK_INTERVAL = 300;

globalThis.typodontHid = {
  /** Asks the user for a device, and returns its name; undefined if none was chosen. */
  ask: async kinds => {
    if (!navigator.hid) throw new Error("WebHID");
    const [device] = await navigator.hid.requestDevice({ filters: filters(kinds) });
    return device?.productName;
  },

  /**
   * Opens the devices of these kinds that the user has allowed, now and whenever one is plugged in or allowed. Calls
   * `connected(number, vendor, product, usagePage, usage, name)`, `received(number, id, bytes)` for each report, `run()` after one or
   * more of them, `gone(number)`, and `refused(why)` where no device can be opened. Returns `isIdle(number)`, and
   * `send(number, id, bytes)`, after which `idle()` is called when the device has taken the report.
   */
  openAllowed: (kinds, { connected, received, run, gone, refused, idle }) => {
    const open = new Map();
    const sending = new Set();
    let count = 0;
    // Of several reports that have come, the newest is answered.
    const runs = new MessageChannel();
    let isDue = false;
    runs.port1.onmessage = () => {
      isDue = false;
      run();
    };
    const take = async device => {
      const kind = kinds.find(kind => isOurs(device, kind));
      if (!kind || [...open.values()].includes(device)) return;
      const number = ++count;
      open.set(number, device);
      try {
        if (!device.opened) await device.open();
      } catch (error) {
        open.delete(number);
        return refused(`${device.productName}: ${error.message}`);
      }
      // It may have been unplugged meanwhile.
      if (open.get(number) !== device) return;
      connected(number, device.vendorId, device.productId, ...(kind.usage ?? [0, 0]), device.productName);
      device.oninputreport = ({ reportId, data }) => {
        received(number, reportId, new Uint8Array(data.buffer, data.byteOffset, data.byteLength));
        if (!isDue) runs.port2.postMessage(isDue = true);
      };
    };
    const look = () => navigator.hid.getDevices().then(devices => devices.forEach(take), error => refused(error.message));
    // Two windows would lead one hand.
    const claim = () => navigator.locks.request("typodont-hid", { ifAvailable: true }, lock => {
      if (!lock) {
        refused("another window of this browser uses it");
        setTimeout(claim, LOOK_INTERVAL);
        return;
      }
      look();
      setInterval(() => { if (!open.size) look(); }, LOOK_INTERVAL);
      navigator.hid.addEventListener("connect", ({ device }) => take(device));
      return new Promise(() => {});
    });
    if (navigator.hid) {
      navigator.hid.addEventListener("disconnect", ({ device }) => {
        for (const [number, other] of open) {
          if (other === device) {
            open.delete(number);
            gone(number);
          }
        }
      });
      claim();
    } else {
      refused("this browser lets no exercise use a device; Chrome and Edge do from version 131 on");
    }
    return {
      isIdle: number => open.has(number) && !sending.has(number),
      send: (number, id, bytes) => {
        sending.add(number);
        // A device that takes no report is noticed by its silence.
        open.get(number).sendReport(id, bytes).catch(() => {}).then(() => {
          sending.delete(number);
          idle();
        });
      },
    };
  },
};
