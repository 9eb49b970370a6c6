// What a learning platform is told about a session, from its session.json.

/** Ways in which a critical error changes the points: as `typodont gradebook --critical`. */
const CRITICAL = {
  keep: points => points,
  cap: (points, grade) => Math.max(0, Math.min(points, grade.pass_points - 1)),
  zero: () => 0,
};

const rounded = value => Math.round(value * 100) / 100;

/**
 * The result of a session.
 *
 * `session` is the content of session.json; `zip` is `{ name, sha256 }` of the bundle that the page offers to save; `critical` is one
 * of keep, cap and zero. `percent` and `passed` are null where the exercise has no grade.
 */
export function resultOf(session, zip, critical) {
  const grade = session.grade || null;
  const isFinished = grade ? grade.finished !== false : session.stages.every(stage => stage.ended_by !== 'abort');
  const seconds = session.stages.reduce((end, stage) => Math.max(end, stage.ended_s), 0);
  const result = {
    exercise: session.scenario.id, started: session.started, seconds, finished: isFinished, percent: null, passed: null, errors: [],
    items: [], zip: zip.name, sha256: zip.sha256,
  };
  if (!grade || !(grade.max_points > 0)) return result;
  const points = grade.hard_fails.length ? CRITICAL[critical](grade.points, grade) : grade.points;
  return {
    ...result,
    percent: rounded(Math.min(100, Math.max(0, 100 * points / grade.max_points))),
    passed: grade.passed,
    errors: grade.hard_fails,
    items: grade.items.map(item => ({ metric: item.metric, title: item.title, points: rounded(item.points), max: rounded(item.max_points) })),
  };
}

/** The result that counts among those of several sessions: as `typodont gradebook --take`. */
export function counting(kept, latest, take) {
  if (!kept || take === 'last') return latest;
  if (take === 'first') return kept;
  const worth = result => [result.passed ? 1 : 0, result.percent ?? 0, result.finished ? 1 : 0];
  const [a, b] = [worth(kept), worth(latest)];
  const first = a.findIndex((value, index) => value !== b[index]);
  return first >= 0 && a[first] > b[first] ? kept : latest;
}

/** Text of a result that is kept by the platform for the next launch, at most `limit` characters long: items first lose their titles. */
export function packed(result, limit) {
  const short = { ...result, items: result.items.map(({ metric, points, max }) => ({ metric, points, max })) };
  const shorter = { ...short, items: [], errors: result.errors.map(title => title.slice(0, 80)).slice(0, 4) };
  for (const candidate of [result, short, shorter, { ...shorter, errors: [] }]) {
    const text = JSON.stringify({ version: 1, result: candidate });
    if (text.length <= limit) return text;
  }
  return '';
}

/** The result in a text made by `packed`; null if it is not such a text. */
export function unpacked(text) {
  try {
    const kept = JSON.parse(text);
    return kept && kept.version === 1 && kept.result && Array.isArray(kept.result.items) ? kept.result : null;
  } catch {
    return null;
  }
}

/**
 * A participant code from the learner's name in the platform: characters that a code may not have become their number in
 * hexadecimal between two `_`, so that two learners never share a code unless their names agree in the first characters of a very long
 * one.
 */
export function participantCode(learner) {
  const escaped = Array.from(learner, c => /[A-Za-z0-9.-]/.test(c) ? c : `_${c.codePointAt(0).toString(16)}_`);
  return escaped.join('').slice(0, 64);
}
