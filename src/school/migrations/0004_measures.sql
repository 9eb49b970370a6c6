-- Measures change only together with the score they belong to: a worker replaces a session's measures of one scorer version in the
-- transaction that enters its own score of that version, which is once, and every removal is in the audit log.

-- Who scored, and when, is what the database knows and not what a worker writes.
DROP POLICY worker_writes ON typodont.score;
CREATE POLICY worker_writes ON typodont.score FOR INSERT TO typodont_worker
  WITH CHECK (scored_by = session_user AND scored_at = now());

DROP POLICY worker_writes ON typodont.metric_value;
CREATE POLICY worker_writes ON typodont.metric_value FOR INSERT TO typodont_worker
  WITH CHECK (EXISTS (SELECT FROM typodont.score k
    WHERE k.session_id = metric_value.session_id AND k.scorer_version = metric_value.scorer_version
      AND k.scored_by = session_user AND k.scored_at = now()));

DROP POLICY worker_replaces ON typodont.metric_value;
CREATE POLICY worker_replaces ON typodont.metric_value FOR DELETE TO typodont_worker
  USING (EXISTS (SELECT FROM typodont.score k
    WHERE k.session_id = metric_value.session_id AND k.scorer_version = metric_value.scorer_version
      AND k.scored_by = session_user AND k.scored_at = now()));

CREATE FUNCTION typodont.note_removed_measures() RETURNS trigger
LANGUAGE plpgsql SECURITY DEFINER SET search_path = pg_catalog, pg_temp
AS $$
BEGIN
  -- An erased session is no longer named; its erasure has a line of its own.
  INSERT INTO typodont.audit (action, session_id, detail)
    SELECT 'measures removed', r.session_id, count(*) || ' of scorer version ' || r.scorer_version
    FROM removed r JOIN typodont.session s ON s.id = r.session_id
    GROUP BY r.session_id, r.scorer_version;
  RETURN NULL;
END $$;
CREATE TRIGGER removal_audited AFTER DELETE ON typodont.metric_value REFERENCING OLD TABLE AS removed
  FOR EACH STATEMENT EXECUTE FUNCTION typodont.note_removed_measures();
